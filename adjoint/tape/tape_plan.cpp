#include "adjoint/tape/tape_plan.h"

#include "adjoint/tape/footprint.h"
#include "adjoint/tape/tape.h"
#include "core/scalar/dual.h"
#include "core/scalar/pack.h"

namespace sheetbend {
namespace {

template <class T>
inline constexpr std::size_t lanes_of = std::is_same_v<T, Pack> ? Pack::lanes : 1;

}  // namespace

template <class T>
TapePlan plan_tape(const Scene& scene, const Plan& plan, int steps, std::size_t frames, std::size_t scenes,
                   std::size_t budget) {
  TapePlan p;
  p.steps = steps;
  const std::size_t dofs = scene.dofs(), total = scene.layout.total();
  const std::size_t number = sizeof(T) / lanes_of<T>;
  p.inputs = 2 * number * scenes * total;
  p.frames = 2 * number * scenes * frames * dofs;
  if constexpr (!std::is_same_v<T, double>) {
    p.lanes = static_cast<int>(lanes_of<T>);
    const std::size_t packs = (scenes + lanes_of<T> - 1) / lanes_of<T>;
    p.at_once = static_cast<int>(std::min<std::size_t>(packs, plan.options.threads));
    p.inputs += 2 * sizeof(T) * total * p.at_once;
    p.frames += 2 * sizeof(T) * frames * dofs * p.at_once;
  }
  p.plan = plan_bytes(plan);
  p.forward = p.at_once * rollout_bytes<T>(scene, plan);
  p.reverse = p.at_once * reverse_bytes<T>(scene, plan);
  p.heap = p.working() / 50;  // holes that the allocator leaves
  const int window = Tape<T>::window(plan), least = Schedule::least(steps, window);
  const std::size_t state = p.at_once * sizeof(T) * dofs;
  const int ends = Tape<T>::ends(plan);
  const std::size_t formulas = changes_at_contacts(scene, plan.options)
                                   ? p.at_once * sizeof(Scenes) * static_cast<std::size_t>(std::max(1, steps))
                                   : 0;
  p.least = p.working() + (least + ends) * state + formulas;
  if (budget < p.least) throw BudgetTooSmall(p.least);
  p.states =
      static_cast<int>(std::min<std::size_t>(std::max(1, steps), (budget - p.working() - formulas) / state - ends));
  p.tape = (p.states + ends) * state + formulas;
  p.recomputed = recomputed_steps(steps, p.states, window);
  return p;
}

template TapePlan plan_tape<double>(const Scene&, const Plan&, int, std::size_t, std::size_t, std::size_t);
template TapePlan plan_tape<Pack>(const Scene&, const Plan&, int, std::size_t, std::size_t, std::size_t);
template TapePlan plan_tape<Dual<double, 1>>(const Scene&, const Plan&, int, std::size_t, std::size_t, std::size_t);

}  // namespace sheetbend
