// The contacts that go by sweeps (swept_contacts.h), and which of them go eight particles at a time.
#pragma once

#include "core/solver/plan.h"

namespace sheetbend {

// The contacts of movable particles, in the order of the scene.
std::vector<SweptContact> swept_contacts(const Scene& scene);

// The same in groups, one for each contact of the scene. Particles on grids and particles that rebound go one by one; all others go in packs.
std::vector<SweptGroup> swept_groups(const Scene& scene, const std::vector<SweptContact>& contacts);

}  // namespace sheetbend
