#include "bind.hpp"
namespace flappy::python {
void bind_flights(nb::module_&) {}
}
