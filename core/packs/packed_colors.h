// Colors in packs: where each constraint's numbers are, and the arrays that the kernels work on. For one scene (T = double) a pack is eight
// constraints of a color; for eight scenes in lanes (T = Pack) it is one constraint. Duals of forward rollouts have the values of one scene, and
// eight directions beside each.
#pragma once

#include <algorithm>
#include <vector>

#include "core/packs/lanes.h"
#include "core/packs/sections.h"
#include "core/scalar/numbers.h"
#include "core/scalar/vec3.h"
#include "core/scene/scene.h"
#include "core/threads/pool.h"

namespace sheetbend {

// Scalars whose colors go through the kernels; others go one constraint at a time.
template <class T>
inline constexpr bool in_packs = std::is_same_v<T, double> || std::is_same_v<T, Pack> || carries_tangents<T>;

template <class T>
inline constexpr sheetbend_packs::Layout layout_of =
    std::is_same_v<T, Pack> ? sheetbend_packs::across_scenes : sheetbend_packs::across_color;

// Constraints of one group that share no movable node.
struct Color {
  int group;
  std::vector<int> items;
};

// Number `part` of `parts` of the color's constraint `i`.
template <class T>
decltype(auto) entry(Numbers<T>& v, int i, int parts, int part) {
  return v[std::is_same_v<T, Pack> ? static_cast<long>(i) * parts + part : lane_at(i, parts, part)];
}

// Rows of particles, or their cotangents.
template <class T>
struct Rows : Numbers<T> {
  void assign(int count) { Numbers<T>::assign(sheetbend_packs::row * static_cast<std::size_t>(count)); }
  static std::size_t bytes(int count) { return sizeof(T) * sheetbend_packs::row * static_cast<std::size_t>(count); }
  auto* at(int row) { return this->data() + sheetbend_packs::row * static_cast<long>(row); }
};

// Runs a kernel over a color's packs; below `grain` constraints per thread it uses fewer threads.
template <class Arrays>
void run_kernel(void (*kernel)(const Arrays&, int, int), const Arrays& arrays, int packs, int threads, int grain) {
  if (threads == 1) return kernel(arrays, 0, packs);
  parallel_for(packs, threads, std::max(1, grain / sheetbend_packs::lanes),
               [&](int begin, int end) { kernel(arrays, begin, end); });
}

// One color, eight constraints to a pack; a short last pack repeats its last constraint.
struct PackedColor {
  int kind, group, count;
  int rows, arity, parameters, kept;
  bool damped, unit_gradients;
  std::vector<int> items;  // (packs, 8)
  std::vector<int> nodes;  // (packs, arity, 8) places of their rows in PackState

  // How many constraints there are to fill in, those that only fill up a pack included; and how many packs.
  template <class T>
  int entries() const {
    return std::is_same_v<T, Pack> ? count : static_cast<int>(items.size());
  }
  template <class T>
  int packs() const {
    return std::is_same_v<T, Pack> ? count : static_cast<int>(items.size()) / sheetbend_packs::lanes;
  }
  int value_count() const { return sheetbend_packs::value_count(damped, parameters, unit_gradients, arity); }
  int record_size() const { return sheetbend_packs::record_size(kept, rows); }
  template <class T>
  std::size_t record_packs() const {
    return static_cast<std::size_t>(packs<T>()) * record_size();
  }
  template <class T>
  int multipliers() const {
    return entries<T>() * rows;
  }
};

// Rows: one per node, then one per use of a fixed node (its own, so that constraints of one color never share a row).
struct PackPlan {
  std::vector<PackedColor> colors;
  std::vector<int> ghosts;  // the fixed nodes behind the rows after the nodes' own
  int nodes = 0;
  int rows() const { return nodes + static_cast<int>(ghosts.size()); }
};

PackPlan pack_colors(const Scene& scene, const std::vector<Color>& colors);

// Bytes: what may be recorded as a whole, and what a section may take otherwise. Measured: docs/decisions.
inline constexpr std::size_t whole_record = 8 << 20, section_record = 2 << 20;
template <class T>
Sections sections_of(const PackPlan& plan, int sweeps, std::size_t whole = whole_record,
                     std::size_t section = section_record);

// What stands per constraint of a color, or its cotangents.
template <class T>
struct ColorNumbers {
  Numbers<T> values, lambda, C_r;

  void resize(const PackedColor& color, int value_count) {
    const std::size_t entries = color.entries<T>();
    values.assign(entries * value_count);
    lambda.assign(entries * color.rows);
    C_r.assign(color.damped ? entries * color.rows : 0);
  }
};

// The numbers of one substep in the kernels' order. T: double, Pack, Dual<double, 4 or 8>.
template <class T>
struct PackState {
  struct ColorState : ColorNumbers<T> {
    std::vector<Numbers<Pack>> records;     // per sweep of a section; empty where nothing is kept
    std::vector<Numbers<T>> lambda_before;  // where sections begin, all but the last
  };
  Rows<T> rows;
  std::vector<Rows<T>> rows_before;
  std::vector<ColorState> colors;
  Sections sections;
  int recorded = 0;  // the section whose sweeps are recorded, counted from the last
  double eta = 0.0;  // of `values`; 0 where they are not filled yet

  void resize(const PackPlan& plan, const Sections& sections);
  static std::size_t bytes(const PackPlan& plan, const Sections& sections);  // that resize() allocates; double, Pack
};

// Fills values for eta (nothing to do when they are there and no drag changes w: one state serves one vector of inputs), weights from w
// (nodes), references from C_r (rows of the scene), the rows of uses of fixed nodes from the nodes' own. Duals, whose rows hold values and
// directions apart, have the coordinates q (dofs) put there first, and read back by end_sweeps.
template <class T>
void begin_sweeps(const Scene& scene, const PackPlan& plan, const Inputs<const T>& in, double eta, const T* w,
                  const T* C_r, PackState<T>& state, const T* q = nullptr);
template <class T>
void end_sweeps(const Scene& scene, PackState<T>& state, T* q);

// One pass over all colors; the first (0) starts from no multipliers. Keeps what the reverse of the last section needs, and where the others begin.
template <class T>
void sweep(const PackPlan& plan, const sheetbend_packs::KernelTable& kernels, int threads, int grain, int iteration,
           PackState<T>& state);

// Sweeps the section of `iteration` again, if its record is not the one at hand; the coordinates of later ones are lost.
template <class T>
void sweep_again(const PackPlan& plan, const sheetbend_packs::KernelTable& kernels, int threads, int grain,
                 int iteration, PackState<T>& state);

// Writes the multipliers in the scene's order, (rows).
template <class T>
void unpack_multipliers(const Scene& scene, const PackPlan& plan, PackState<T>& state, T* lambda);

// The kernels that this machine can run, widest first: of x86-64-v4, x86-64-v3, portable. They give the same bits.
std::vector<const sheetbend_packs::KernelTable*> available_kernels();

// The first of them, or the one that the environment variable SHEETBEND_ISA names. Throws std::runtime_error for one that cannot run.
const sheetbend_packs::KernelTable& pack_kernels();

}  // namespace sheetbend
