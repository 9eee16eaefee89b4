// How far noise may carry a point of a cloud over the border of a cloth, or over the end of a rope.
#pragma once

namespace sheetbend {

inline constexpr double overhang = 3.0;  // of the point's sigma: what is farther over counts

}  // namespace sheetbend
