// Lets a caller stop long work: poll() is called now and then and may throw.
#pragma once

namespace sheetbend {

struct Interrupt {
  virtual ~Interrupt() = default;
  virtual void poll() = 0;
};

}  // namespace sheetbend
