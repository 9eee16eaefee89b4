// Colors in packs of eight: where each constraint's lane is, and the arrays that the kernels work on.
#pragma once

#include <algorithm>
#include <vector>

#include "core/packs/kernels.h"
#include "core/scalar/pack.h"
#include "core/scalar/vec3.h"
#include "core/scene/scene.h"
#include "core/threads/pool.h"

namespace sheetbend {

// Constraints of one group that share no movable node.
struct Color {
  int group;
  std::vector<int> items;
};

// A vector of packs as plain numbers, and where entry `part` of `parts` stands in it for a lane.
inline double* numbers(std::vector<Pack>& v) { return reinterpret_cast<double*>(v.data()); }
inline long lane_at(int lane, int parts, int part) {
  return (static_cast<long>(lane / sheetbend_packs::lanes) * parts + part) * sheetbend_packs::lanes +
         lane % sheetbend_packs::lanes;
}

// Rows of particles, or their cotangents.
class Rows {
 public:
  void assign(int count) {
    constexpr int per_pack = Pack::lanes / sheetbend_packs::row;
    packs_.assign((static_cast<std::size_t>(count) + per_pack - 1) / per_pack, Pack(0.0));
  }
  void clear() { std::fill(packs_.begin(), packs_.end(), Pack(0.0)); }
  double* at(int row) { return numbers(packs_) + sheetbend_packs::row * static_cast<long>(row); }

 private:
  std::vector<Pack> packs_;
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
  int kind, group, count, packs;
  int rows, arity, parameters;
  bool damped;
  std::vector<int> items;  // (packs, 8)
  std::vector<int> nodes;  // (packs, arity, 8) places of their rows in PackState
  int value_count() const { return sheetbend_packs::value_count(damped, parameters); }
  int record_size() const { return sheetbend_packs::record_size(3 * arity, rows); }
};

// Rows: one per node, then one per use of a fixed node (its own, so that constraints of one color never share a row).
struct PackPlan {
  std::vector<PackedColor> colors;
  std::vector<int> ghosts;  // the fixed nodes behind the rows after the nodes' own
  int nodes = 0;
  int rows() const { return nodes + static_cast<int>(ghosts.size()); }
};

PackPlan pack_colors(const Scene& scene, const std::vector<Color>& colors);

// The numbers of one substep in the kernels' order.
struct PackState {
  struct ColorState {
    std::vector<Pack> values, lambda, C_r;
    std::vector<std::vector<Pack>> records;  // per iteration; empty where nothing is kept
  };
  Rows rows;
  std::vector<ColorState> colors;
  double eta = 0.0;  // of `values`; 0 where they are not filled yet

  void resize(const PackPlan& plan, int kept_iterations);
};

// Fills values for eta (nothing to do when they are there: one state serves one vector of inputs), rows from q (dofs) and w (nodes),
// references from C_r (rows of the scene); clears the multipliers.
void begin_sweeps(const Scene& scene, const PackPlan& plan, const Inputs<const double>& in, double eta, const double* q,
                  const double* w, const double* C_r, PackState& state);

// One pass over all colors; keeps what the reverse needs where `state` has records.
void sweep(const PackPlan& plan, const sheetbend_packs::KernelTable& kernels, int threads, int grain, int iteration,
           PackState& state);

// Writes q of the nodes.
void end_sweeps(const Scene& scene, const PackPlan& plan, PackState& state, double* q);

// Writes the multipliers in the scene's order, (rows).
void unpack_multipliers(const Scene& scene, const PackPlan& plan, PackState& state, double* lambda);

// The kernels that this machine can run, widest first: of x86-64-v4, x86-64-v3, x86-64-v2, portable. They give the same bits.
std::vector<const sheetbend_packs::KernelTable*> available_kernels();

// The first of them, or the one that the environment variable SHEETBEND_ISA names. Throws std::runtime_error for one that cannot run.
const sheetbend_packs::KernelTable& pack_kernels();

}  // namespace sheetbend
