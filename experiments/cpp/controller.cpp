// Carries a hanging rope by its driven particles until its end is at a target: controller SCENE PARTICLE X Y Z SECONDS
#include <sheetbend/sheetbend.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

int main(int count, char** arguments) {
  if (count != 7) {
    std::fprintf(stderr, "usage: %s SCENE PARTICLE X Y Z SECONDS\n", arguments[0]);
    return 2;
  }
  try {
    const auto scene = sheetbend::Scene::load(arguments[1]);
    const auto end = static_cast<std::size_t>(std::atoi(arguments[2]));
    if (scene.driven().empty()) throw sheetbend::InputError("scene", "has no grip", "drive a particle of it");
    if (end >= scene.particles()) throw sheetbend::InputError("PARTICLE", "does not exist", "name one of the scene");
    const double target[]{std::atof(arguments[3]), std::atof(arguments[4]), std::atof(arguments[5])};
    const double h = 1.0 / 600.0, gain = 1.0, against_sway = 2.0, fastest = 0.5;  // s, 1/s, 1/s, m/s
    sheetbend::Stepper stepper(scene, {.h = h});

    std::vector<double> grip;
    for (const int held : scene.driven())
      for (std::size_t k = 0; k < 3; ++k) grip.push_back(stepper.positions()[3 * static_cast<std::size_t>(held) + k]);

    // Everything is allocated: from here on the loop only measures, moves and steps.
    const long substeps = std::lround(std::atof(arguments[6]) / h);
    for (long n = 0; n < substeps; ++n) {
      const auto place = stepper.positions().subspan(3 * end, 3);
      double move[3];
      for (std::size_t k = 0; k < 3; ++k) {
        const double sway = k < 2 ? grip[k] - place[k] : 0.0;  // of the end below the grip
        const double speed = gain * (target[k] - place[k]) - against_sway * sway;
        move[k] = h * std::clamp(speed, -fastest, fastest);
      }
      for (std::size_t i = 0; i < grip.size(); ++i) grip[i] += move[i % 3];
      stepper.step(grip);
    }
    const auto place = stepper.positions().subspan(3 * end, 3);
    std::printf("after %.3f s at %.9g %.9g %.9g\n", stepper.time(), place[0], place[1], place[2]);
  } catch (const sheetbend::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
