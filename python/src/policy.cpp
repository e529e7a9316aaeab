#include "bind.hpp"
namespace flappy::python {
void bind_policy(nb::module_&) {}
}
