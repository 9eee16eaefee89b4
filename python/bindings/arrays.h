// NumPy at the border: checked views in, owned arrays out.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <stdexcept>
#include <string>
#include <vector>

namespace sheetbend::bindings {

namespace py = pybind11;
using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

inline py::array_t<double> to_numpy(const std::vector<double>& values, std::vector<py::ssize_t> shape) {
  py::array_t<double> out(std::move(shape));
  std::copy(values.begin(), values.end(), out.mutable_data());
  return out;
}

// An array, or a list, of whole numbers.
inline std::vector<int> whole_numbers(const py::handle& values) {
  const auto a = values.cast<py::array_t<int, py::array::c_style | py::array::forcecast>>();
  return {a.data(), a.data() + a.size()};
}

inline void expect_size(const Array& a, std::size_t size, const char* name) {
  if (static_cast<std::size_t>(a.size()) != size)
    throw std::invalid_argument(std::string(name) + ": got " + std::to_string(a.size()) + " numbers. Fix: give " +
                                std::to_string(size));
}

}  // namespace sheetbend::bindings
