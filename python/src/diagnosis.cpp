#include "bind.hpp"
namespace flappy::python {
void bind_diagnosis(nb::module_&) {}
}
