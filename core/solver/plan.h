// A solver is a partition of the constraints into blocks. Blocks of one go by color (nonlinear Gauss-Seidel: constraints of one color
// share no movable particle); a connected set can be one direct block. The plan is found once per scene and shared.
#pragma once

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "core/blocks/kernels.h"
#include "core/linear/condensed.h"
#include "core/packs/packed_colors.h"
#include "core/scene/scene.h"
#include "core/solver/options.h"

namespace sheetbend {

// A reference to constraint `item` of group `group`.
struct Member {
  int group, item;
  int first_row;  // in the block's matrix
};

// A row of constraints, and which of its constraint's nodes a node is.
struct RowUse {
  int row, place;
};

// Nodes that can move, each with the rows that it takes part in, ascending; in the order in which elimination meets them.
using RowsOfNodes = std::vector<std::pair<int, std::vector<RowUse>>>;

// A block's members of one group, in elimination order; lanes past the end repeat the last one.
struct MemberRun {
  int group, count;
  std::vector<int> items;      // (packs, 8)
  std::vector<int> nodes;      // (packs, arity, 8) as in sheetbend_blocks::Run
  std::vector<int> gradients;  // (packs, arity, 8)
  std::vector<int> first_row;  // (packs, 8)
  // (packs, triangle(dofs), 8) of implicit blocks: where a member's matrix stands in the condensed one, -1 for what is fixed or past the end
  std::vector<int> entries = {};
};

// A kept volume of a block, with one row behind those of the constraints. Windows and gradients have it as any other row.
struct BlockVolume {
  int volume, row;
  std::vector<int> particles;  // per node of the volume
  std::vector<int> gradients;  // likewise, its gradient row
};

// A point of an implicit block that may touch a collider: of one particle, or of several with weights (BlockContacts).
struct BlockContact {
  int contact, item;  // in the scene
  int collider;
  AnyShape shape;
  int nodes;                                    // how many
  std::array<int, most_point_nodes> particles;  // in the block's order; they can move
};

// A director or normal of an implicit block (block_frames.h), of an axis: from the tail to the head, or the head where the tail is -1.
struct BlockFrame {
  int particle, tail, head;  // in the block's order
  bool is_normal;
};

struct DirectBlock {
  std::vector<Member> members;  // in elimination order
  std::vector<MemberRun> runs;  // the same by group
  std::vector<int>
      particles;            // the nodes behind the block's particles: the movable ones, then one per use of a fixed one
  std::vector<int> window;  // (particles + 1), and the rows that each takes part in, as in sheetbend_blocks::Block
  std::vector<int> window_rows;
  std::vector<int> multipliers;        // per row: where it stands in the scene
  std::vector<std::size_t> positions;  // of the pairs of rows of each movable particle, where there is no band
  int movable = 0;
  bool damped = false;        // whether any of its groups is
  bool implicit = false;      // solved until its forces balance
  FactorStructure structure;  // of its constraints' matrix; empty where it is condensed
  std::optional<Condensation> condensation = {};
  std::vector<BlockVolume> volumes = {};
  std::vector<BlockContact> contacts = {};  // by first particle
  std::vector<BlockFrame> frames = {};      // of implicit blocks, normals first
  SelfContact surface = {};                 // in the block's order, fixed particles included
  double loop_pivot = 0.0;  // if it closes a loop of bodies: below which a pivot counts as zero (loop_rows.h)

  int size() const { return static_cast<int>(multipliers.size()); }
  bool may_slide() const { return !contacts.empty() || surface.rubs(); }  // something, with friction
  bool banded() const { return !condensation && structure.banded(); }
};

// A particle that may touch a collider, and goes by sweeps (swept_contacts.h).
struct SweptContact {
  int contact, item;  // in the scene
  int node, collider;
  AnyShape shape;
};

// The particles of one contact that go by sweeps, those from `first` on in Plan::contacts.
struct SweptGroup {
  int contact, first, count;
  // Of groups that go through kernels (core/contact/kernels.h): (packs, 8), where a short last pack repeats its last particle. Otherwise empty.
  std::vector<int> nodes = {}, carries = {};

  bool packed() const { return !nodes.empty(); }
};

// Constraints that join balls to other particles (joined_balls.h).
struct Assembly {
  std::vector<Member> members;  // in elimination order
  FactorStructure structure;    // of J M^-1 J^T + a
  RowsOfNodes joined;           // by node
};

struct Plan {
  SolverOptions options;
  std::vector<Color> colors;
  PackPlan packs;  // the same colors, eight constraints at a time
  std::vector<DirectBlock> blocks;
  std::vector<SweptContact> contacts = {};      // between sweeps, in the order of the scene
  std::vector<SweptGroup> contact_groups = {};  // the same, one for each contact of the scene
  std::vector<Assembly> assemblies = {};
  std::vector<int> assembly_of_ball = {};  // per ball: its place in `assemblies`, or -1
};

// Iterations over blocks and colors that a record for the reverse holds; an implicit step is known by where it ends.
inline int kept_iterations(const Plan& plan, bool keep) {
  return keep && plan.options.partition != Partition::implicit ? plan.options.iterations : 0;
}

// Whether this plan's constraints go through the kernels of core/packs.
template <class T>
bool sweeps_packs(const Plan& plan) {
  return in_packs<T> && !plan.colors.empty();
}

Plan make_plan(const Scene& scene, const SolverOptions& options);

}  // namespace sheetbend
