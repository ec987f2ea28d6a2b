// The module jackal_aic._core: the controllers, the drive loop and the simulated robot for Python.

#include "bindings.hpp"
#include "jackal_aic/config/text.hpp"

PYBIND11_MODULE(_core, m) {
  namespace python = jackal_aic::python;
  m.doc() = "Controllers, drive loop and simulated robot of jackal_aic; use them through the package jackal_aic.";
  pybind11::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const jackal_aic::ParameterError& error) {
      PyErr_SetString(PyExc_ValueError, jackal_aic::onOneLine(error.what()).c_str());
    }
  });
  python::bindParameters(m);
  python::bindControllers(m);
  python::bindLoop(m);
  python::bindAnalysis(m);
  python::bindSimulation(m);
}
