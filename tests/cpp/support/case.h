// A row of cases.h, of a kind by its number: compiled once, for tests that need no row as a constant of a type.
#pragma once

#include <string>
#include <vector>

namespace sheetbend::testing {

// How C answers when the whole stencil (and its normal) turns: it stays, or it turns along as a vector.
enum class UnderRotation { stays, turns };

struct Case {
  std::vector<double> x,
      p;  // the stencil's coordinates, away from degenerate shapes, and the parameters inside C
  double compliance,
      damping;  // of a size at which a and g matter for particles of about 20 g and substeps of about 4 ms
  UnderRotation under_rotation;
  int normal = -1;  // first of the three parameters that are a direction; then C only has to be symmetric about it
  std::vector<int> relabeling;  // of the stencil, under which C becomes sign C, row by row, ...
  std::vector<int> sign;
  std::vector<int> parameter_sign;             // ... when the parameters take these signs
  std::vector<int> parameter_relabeling = {};  // and these places; empty: their own
  bool curved = true;                          // whether C has second derivatives
};

Case case_of(int kind);
std::string kind_name(int kind);

}  // namespace sheetbend::testing
