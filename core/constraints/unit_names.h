// Units as text, such as "1/(N m)".
#pragma once

#include <string>

#include "core/constraints/parameter.h"

namespace sheetbend {

inline std::string power_of_meter(int power) { return power == 1 ? "m" : "m^" + std::to_string(power); }

// "" without a unit.
inline std::string unit_name(const Unit& unit) {
  if (unit.angle) return "rad";
  if (unit.meters == 0) return "";
  return unit.meters > 0 ? power_of_meter(unit.meters) : "1/" + power_of_meter(-unit.meters);
}

// Of the compliance of a constraint whose C has the unit: unit^2/(N m).
inline std::string compliance_unit(const Unit& unit) {
  const int meters = 2 * unit.meters - 1;
  if (unit.angle) return "rad/(N m)";
  return meters > 0 ? power_of_meter(meters) + "/N" : "1/(N " + power_of_meter(-meters) + ")";
}

// Of its damping coefficient: N m s/unit^2.
inline std::string damping_unit(const Unit& unit) {
  const int meters = 2 * unit.meters - 1;
  if (unit.angle) return "N m s/rad";
  return meters > 0 ? "N s/" + power_of_meter(meters) : "N " + power_of_meter(-meters) + " s";
}

}  // namespace sheetbend
