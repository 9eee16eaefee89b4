#include "core/contact/shapes.h"

#include <stdexcept>

namespace sheetbend {

void throw_unknown_shape(int shape) {
  throw std::logic_error("shape " + std::to_string(shape) + " is not in the list");
}

int shape_of(const std::string& name) {
  int found = -1;
  std::string known;
  for (int shape = 0; shape < shape_count; ++shape)
    with_shape(shape, [&]<class S>(S) {
      if (name == S::name) found = shape;
      known += (shape ? ", " : "") + std::string(S::name);
    });
  if (found < 0) throw std::invalid_argument("colliders: no shape is called '" + name + "'. Fix: use one of " + known);
  return found;
}

}  // namespace sheetbend
