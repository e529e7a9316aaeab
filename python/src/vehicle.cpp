#include "bind.hpp"
namespace flappy::python {
void bind_vehicle(nb::module_&) {}
}
