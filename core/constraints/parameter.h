// What a constraint kind says about its numbers: units, ranges, and where a value comes from that nobody gives. The bindings, the documentation and the
// checks of scenes read this; kernels do not.
#pragma once

#include <limits>

namespace sheetbend {

// A power of the meter, or an angle. A constraint whose C has this unit has a compliance in unit^2/(N m) and a damping coefficient in N m s/unit^2.
struct Unit {
  int meters = 0;
  bool angle = false;
};
namespace units {
inline constexpr Unit none{}, radians{0, true}, meters{1}, square_meters{2}, cubic_meters{3}, per_meter{-1};
}

// The least and the largest value that are allowed.
struct Range {
  double least = -std::numeric_limits<double>::max(), most = std::numeric_limits<double>::max();
};
namespace ranges {
inline constexpr double below_one = 1.0 - std::numeric_limits<double>::epsilon() / 2;
inline constexpr Range any{}, positive{std::numeric_limits<double>::denorm_min()};
inline constexpr Range between_minus_one_and_one{-below_one, below_one}, from_zero_below_one{0.0, below_one};
}  // namespace ranges

// Where a parameter's value comes from.
enum class Source {
  given,     // from the array `rest` of a group; there is no other value
  measured,  // from `rest`, else measured on the first positions (rest_values.h)
  usual,     // from `rest`, else the default's value
  normal,    // one coordinate of the group's unit normal
  preset     // the default's value; `rest` has no column for it, quantities may make it
};
struct Default {
  Source source;
  double value = 0.0;
};
namespace defaults {
inline constexpr Default given{Source::given}, measured{Source::measured}, normal{Source::normal};
constexpr Default usually(double value) { return {Source::usual, value}; }
constexpr Default preset(double value) { return {Source::preset, value}; }
}  // namespace defaults

struct Parameter {
  const char* name;
  Unit unit;
  Range range;
  Default otherwise;
};

// What a kind's compliance is. A scalar one counts all rows alike, |C|^2/(2 alpha); a matrix is factored into the rows, which parameters weigh against
// each other.
struct Compliance {
  enum Form { scalar, matrix };
  const char* made_of;  // in words, such as "link length / EA"
  Form form = scalar;
  const char* never_zero = nullptr;  // why the rigid form is refused; null where a compliance of zero is allowed
};

}  // namespace sheetbend
