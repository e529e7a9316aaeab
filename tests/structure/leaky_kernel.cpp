// A kernel as it must not be: the linker may give its copy of flappy::twice to code for any processor.
namespace flappy {

template <class T>
__attribute__((noinline)) T twice(T x) {
  return 2 * x;
}

namespace sim::v4 {
double step(double x) { return twice(x); }
}  // namespace sim::v4

}  // namespace flappy
