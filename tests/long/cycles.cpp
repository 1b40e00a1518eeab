#include "tests/long/cycles.hpp"

#include <algorithm>
#include <deque>

namespace hil::stress {

namespace {

constexpr std::uint32_t unseen = 0xFFFFFFFFu;

const char* reason(Dependency dependency) {
  switch (dependency) {
    case Dependency::write_write:
      return "wrote behind it";
    case Dependency::write_read:
      return "read what it wrote";
    case Dependency::read_write:
      return "wrote behind what it read";
    case Dependency::real_time:
      return "began after its end";
  }
  return "?";
}

}  // namespace

std::string describe(const std::vector<Edge>& cycle) {
  if (cycle.empty()) return "no cycle";
  std::string text = "transaction " + std::to_string(cycle.front().from);
  for (const Edge& edge : cycle)
    text += " -> " + std::to_string(edge.to) + " (" + reason(edge.dependency) + ")";
  return text;
}

void DependencyGraph::add(std::uint32_t from, std::uint32_t to, Dependency dependency) {
  if (from == to || from >= edges_.size() || to >= edges_.size()) return;
  edges_[from].push_back({from, to, dependency});
}

/// Tarjan 1972, with a stack of its own: histories are long.
bool DependencyGraph::component_with_cycle(unsigned dependencies, std::vector<std::uint32_t>& component,
                                           std::uint32_t& start) const {
  const std::size_t count = edges_.size();
  std::vector<std::uint32_t> number(count, unseen);
  std::vector<std::uint32_t> lowest(count, 0);
  std::vector<std::uint32_t> open;
  struct Visit {
    std::uint32_t node;
    std::size_t next_edge;
  };
  std::vector<Visit> visits;
  std::uint32_t next_number = 0;
  std::uint32_t next_component = 0;
  component.assign(count, unseen);
  bool found = false;
  for (std::uint32_t root = 0; root < count; ++root) {
    if (number[root] != unseen) continue;
    visits.push_back({root, 0});
    while (!visits.empty()) {
      auto& [node, next_edge] = visits.back();
      if (next_edge == 0 && number[node] == unseen) {
        number[node] = lowest[node] = next_number++;
        open.push_back(node);
      }
      if (next_edge < edges_[node].size()) {
        const Edge& edge = edges_[node][next_edge++];
        if ((dependencies & bit(edge.dependency)) == 0) continue;
        if (number[edge.to] == unseen) {
          visits.push_back({edge.to, 0});
        } else if (component[edge.to] == unseen) {
          lowest[node] = std::min(lowest[node], number[edge.to]);
        }
        continue;
      }
      const std::uint32_t done = node;
      visits.pop_back();
      if (!visits.empty()) lowest[visits.back().node] = std::min(lowest[visits.back().node], lowest[done]);
      if (lowest[done] != number[done]) continue;
      std::size_t members = 0;
      for (std::uint32_t member = unseen; member != done; ++members) {
        member = open.back();
        open.pop_back();
        component[member] = next_component;
      }
      ++next_component;
      if (members > 1 && !found) {
        found = true;
        start = done;
      }
    }
  }
  return found;
}

std::vector<Edge> DependencyGraph::cycle(unsigned dependencies) const {
  std::vector<std::uint32_t> component;
  std::uint32_t start = 0;
  if (!component_with_cycle(dependencies, component, start)) return {};
  // Breadth first inside the component, until an edge comes back.
  std::vector<const Edge*> reached_by(edges_.size(), nullptr);
  std::deque<std::uint32_t> waiting{start};
  while (!waiting.empty()) {
    const std::uint32_t node = waiting.front();
    waiting.pop_front();
    for (const Edge& edge : edges_[node]) {
      if ((dependencies & bit(edge.dependency)) == 0 || component[edge.to] != component[start]) continue;
      if (edge.to == start) {
        std::vector<Edge> cycle{edge};
        for (std::uint32_t at = node; at != start; at = reached_by[at]->from)
          cycle.push_back(*reached_by[at]);
        std::ranges::reverse(cycle);
        return cycle;
      }
      if (reached_by[edge.to] != nullptr) continue;
      reached_by[edge.to] = &edge;
      waiting.push_back(edge.to);
    }
  }
  return {};
}

}  // namespace hil::stress
