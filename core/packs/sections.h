// The reverse of a substep needs a record of every sweep, in reverse order. Where all of them would leave the caches, they are made a section of
// sweeps at a time: each section is swept again, from where it began, just before it is reversed.
#pragma once

#include <algorithm>

namespace sheetbend {

struct Sections {
  int sweeps = 0;  // of a substep whose record is kept; 0 = none is
  int length = 0;  // sweeps in each section; fewer in the first

  int count() const { return length == 0 ? 0 : (sweeps + length - 1) / length; }
  // The section of a sweep, counted from the last one, and the sweep that it begins with.
  int of(int sweep) const { return length == 0 ? 0 : (sweeps - 1 - sweep) / length; }
  int begin(int section) const { return std::max(0, sweeps - (section + 1) * length); }
};

}  // namespace sheetbend
