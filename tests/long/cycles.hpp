#pragma once
// Who has to go before whom, and why; cycles in it.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace hil::stress {

enum class Dependency : std::uint8_t {
  write_write,  ///< the second wrote over (or behind) the first
  write_read,   ///< the second read what the first wrote
  read_write,   ///< the second wrote over what the first read
  real_time,    ///< the first had ended before the second began
};

constexpr unsigned bit(Dependency dependency) {
  return 1u << static_cast<unsigned>(dependency);
}

struct Edge {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  Dependency dependency{};
};

/// "transaction 3 -> 5 (5 read what 3 wrote), ..."
std::string describe(const std::vector<Edge>& cycle);

class DependencyGraph {
 public:
  explicit DependencyGraph(std::size_t transactions) : edges_(transactions) {}

  /// An edge from one to itself, or with an end that is no transaction, is none.
  void add(std::uint32_t from, std::uint32_t to, Dependency dependency);

  /// A shortest cycle through one of the transactions that lie on any, by edges whose bit is set in
  /// `dependencies`; empty: there is none.
  std::vector<Edge> cycle(unsigned dependencies) const;

 private:
  /// A transaction that lies on a cycle, and the number of its strongly connected component for every
  /// transaction; none: nobody does.
  bool component_with_cycle(unsigned dependencies, std::vector<std::uint32_t>& component,
                            std::uint32_t& start) const;

  std::vector<std::vector<Edge>> edges_;  ///< by where they begin
};

}  // namespace hil::stress
