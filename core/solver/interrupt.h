// Lets a caller stop long work: poll() is called now and then and may throw.
#pragma once

namespace sheetbend {

struct Interrupt {
  virtual ~Interrupt() = default;
  virtual void poll() = 0;
};

// Polls before a substep: each one of a large scene, every 64th of a small one, whose substep costs less than looking.
inline void poll(Interrupt* interrupt, int substep, int dofs) {
  if (interrupt && (substep % 64 == 0 || dofs > 10'000)) interrupt->poll();
}

}  // namespace sheetbend
