// What the library knows of a scene, and its motion, gradient and tangent: motion SCENE [key=value...]
#include "shown.h"

int main(int count, char** arguments) {
  using namespace sheetbend;
  return shown([&] {
    const Scene scene = Scene::load(arguments[1]);
    const Solver solver = solver_of(count, arguments);
    std::printf("scene %s %zu %zu %zu %s %d.%d.%d\n", scene.name().c_str(), scene.particles(), scene.nodes(),
                scene.inputs(), SHEETBEND_VERSION, SHEETBEND_VERSION_MAJOR, SHEETBEND_VERSION_MINOR,
                SHEETBEND_VERSION_PATCH);
    for (const Group& g : scene.groups())
      std::printf("group.%s %s %d\n", g.name.c_str(), g.kind.c_str(), g.constraints);
    for (const Quantity& q : scene.quantities()) {
      std::printf("unit.%s %s\n", q.name.c_str(), q.unit.c_str());
      const double numbers[]{q.value, q.scale, q.least, q.most, q.positive ? 1.0 : 0.0};
      print("quantity." + q.name, numbers);
    }
    for (const int n : scene.driven()) std::printf("driven.%d\n", n);
    print("inputs", scene.inputs_of());
    std::printf("redundant %s\n", redundant_constraints(scene, solver).c_str());
    std::vector<double> values = scene.values();
    for (const Quantity& q : scene.quantities())
      values[scene.quantity(q.name)] = scene.values({{q.name, 1.1 * q.value}})[scene.quantity(q.name)];
    const double times[]{0.0, 0.05, 0.1};
    Rollout rollout(scene, times, solver, values);
    print("times", rollout.times());
    print("positions", rollout.positions());
    print("last", rollout.frame(2));
    const Gradient gradient = rollout.gradient(rollout.positions());
    print("quantities", gradient.quantities);
    for (const Array& a : scene.arrays()) print("bar." + std::string(a.name), gradient.by_array(a.name));
    std::printf("recomputed %ld\n", gradient.recomputed);
    print("tangent", rollout.tangent(values));
  });
}
