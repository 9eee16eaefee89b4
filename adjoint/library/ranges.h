// Which inputs a scene can be simulated with: no stiffness, mass or length may be negative.
#pragma once

#include <vector>

#include "core/scene/scene.h"

namespace sheetbend::library {

struct Ranges {
  std::vector<double> least, most;  // of each input, both ends allowed
};

Ranges ranges_of(const Scene& scene);

// Whether plain numbers of an array may not be negative.
bool not_negative(Quantity array);

// The number in words, such as "mass of particle 3".
std::string describe_input(const Scene& scene, std::size_t input);

}  // namespace sheetbend::library
