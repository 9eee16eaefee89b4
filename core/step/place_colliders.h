// Where colliders are around a substep, found once for all stages that look at contacts.
#pragma once

#include "core/step/stages.h"

namespace sheetbend {

struct PlaceColliders {
  static constexpr bool repeated = true;
  static bool may_touch(const Scene& scene) { return !scene.contacts.empty() || !scene.balls.empty(); }

  template <class T>
  struct Record {
    std::vector<ColliderPoses<Single<T>>> scenes;  // of each scene of a T; none where no stage asks

    void resize(const Scene& scene, const Plan&, bool) {
      scenes.resize(may_touch(scene) ? scenes_of<T> : 0);
      for (auto& own : scenes)
        for (auto* poses : {&own.next, &own.now, &own.before}) poses->reserve(scene.colliders.size());
    }
    static std::size_t bytes(const Scene& scene, const Plan&, bool) {
      if (!may_touch(scene)) return 0;
      return scenes_of<T> * (sizeof(ColliderPoses<Single<T>>) + 3 * sizeof(Pose<Single<T>>) * scene.colliders.size());
    }
  };

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Record<T>& record) {
    // Also of scenes that are not solved: blocks read their numbers, with this formula, before they are left out.
    for (int lane = 0; lane < static_cast<int>(record.scenes.size()); ++lane)
      contact_source(step, work.masses, lane).find_poses(record.scenes[lane]);
  }
};

}  // namespace sheetbend
