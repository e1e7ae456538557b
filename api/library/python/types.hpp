#pragma once

#include "api/library/python/to_python.hpp"

namespace plchost::python {

/// The classes of all that calls return, and ClientError.
void define_types(py::module_& module);

}  // namespace plchost::python
