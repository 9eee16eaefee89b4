// Prints what the library knows of a scene, and bits of its motion, gradient and tangent, for tests/python/test_cpp_library.py.
#include <sheetbend/sheetbend.h>

#include <bit>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace {

void print(const std::string& name, std::span<const double> numbers) {
  std::printf("%s", name.c_str());
  for (const double x : numbers) std::printf(" %016llx", static_cast<unsigned long long>(std::bit_cast<std::uint64_t>(x)));
  std::printf("\n");
}

}  // namespace

int main(int, char** arguments) {
  using namespace sheetbend;
  try {
    const Scene scene = Scene::load(arguments[1]);
    std::printf("scene %s %zu %zu %s\n", scene.name().c_str(), scene.particles(), scene.inputs(), SHEETBEND_VERSION);
    for (const Group& g : scene.groups()) std::printf("group %s %s %d\n", g.name.c_str(), g.kind.c_str(), g.constraints);
    print("inputs", scene.inputs_of());
    const std::string method = arguments[2];
    Solver solver{.h = 1.0 / 600.0};
    if (method == "newton") solver.method = Method::newton;
    if (method == "newton_cg") solver.method = Method::newton_cg;
    if (method == "implicit") solver.method = Method::implicit;
    if (method == "gauss_seidel") solver.method = Method::gauss_seidel;
    std::printf("redundant %s\n", redundant_constraints(scene).c_str());
    std::vector<double> values = scene.values();
    for (const Quantity& q : scene.quantities())
      values[scene.quantity(q.name)] = scene.values({{q.name, 1.1 * q.value}})[scene.quantity(q.name)];
    const double times[]{0.0, 0.05, 0.1};
    const Rollout rollout(scene, times, solver, values);
    print("times", rollout.times());
    print("positions", rollout.positions());
    print("last", rollout.frame(2));
    const Gradient gradient = rollout.gradient(rollout.positions());
    print("quantities", gradient.quantities);
    for (const Array& a : scene.arrays()) print("bar." + std::string(a.name), gradient.by_array(a.name));
    print("tangent", rollout.tangent(values));
  } catch (const InputError& e) {
    std::printf("refused: %s | %s | %s\n", e.field().c_str(), e.problem().c_str(), e.fix().c_str());
    return 3;
  }
}
