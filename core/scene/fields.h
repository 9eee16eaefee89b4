// The state is a list of fields. Today there is one, the positions; edge angles, quaternions and carried frames will be others.
// Tape, checkpoints and adjoint treat the state as `dofs` numbers and never ask what they mean.
#pragma once

#include <string>
#include <vector>

namespace sheetbend {

struct Field {
  std::string name;
  int dim = 3;    // coordinates per node
  int count = 0;  // nodes
  int first_node = 0;
  int first_dof = 0;
};

struct Fields {
  std::vector<Field> list;
  int nodes = 0, dofs = 0;

  void add(std::string name, int dim, int count) {
    list.push_back({std::move(name), dim, count, nodes, dofs});
    nodes += count;
    dofs += dim * count;
  }
};

}  // namespace sheetbend
