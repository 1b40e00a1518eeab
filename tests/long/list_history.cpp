#include "tests/long/list_history.hpp"

#include <algorithm>
#include <map>
#include <unordered_map>
#include <unordered_set>
#include <utility>

namespace hil::long_test {

namespace {

constexpr std::uint32_t no_transaction = 0xFFFFFFFFu;

/// `from` is before `to` in every serial order.
struct Edge {
  std::uint32_t from = 0, to = 0;
  const char* reason = "";
};
using Graph = std::vector<std::vector<Edge>>;  ///< the edges of each transaction

/// A shortest cycle through a transaction; empty: there is none.
std::vector<Edge> shortest_cycle(const Graph& graph, std::uint32_t start) {
  std::vector<const Edge*> reached_by(graph.size(), nullptr);
  std::vector<std::uint32_t> reached{start};
  for (std::size_t k = 0; k < reached.size(); ++k) {
    for (const Edge& edge : graph[reached[k]]) {
      if (edge.to == start) {
        std::vector<Edge> cycle{edge};
        for (std::uint32_t at = edge.from; at != start; at = reached_by[at]->from)
          cycle.push_back(*reached_by[at]);
        std::ranges::reverse(cycle);
        return cycle;
      }
      if (reached_by[edge.to] != nullptr) continue;
      reached_by[edge.to] = &edge;
      reached.push_back(edge.to);
    }
  }
  return {};
}

/// Empty: the graph has a topological order.
std::vector<Edge> find_cycle(const Graph& graph) {
  std::vector<std::uint32_t> predecessors(graph.size(), 0);
  for (const auto& edges : graph)
    for (const Edge& edge : edges)
      ++predecessors[edge.to];
  std::vector<std::uint32_t> ordered;
  for (std::uint32_t k = 0; k < graph.size(); ++k)
    if (predecessors[k] == 0) ordered.push_back(k);
  for (std::size_t k = 0; k < ordered.size(); ++k)
    for (const Edge& edge : graph[ordered[k]])
      if (--predecessors[edge.to] == 0) ordered.push_back(edge.to);
  for (std::uint32_t k = 0; k < graph.size(); ++k) {
    if (predecessors[k] == 0) continue;
    if (auto cycle = shortest_cycle(graph, k); !cycle.empty()) return cycle;
  }
  return {};
}

/// The longest read of a list; all others have to be a beginning of it.
struct List {
  std::vector<Value> values;
  std::uint32_t read_by = no_transaction;
};

class Search {
 public:
  explicit Search(const std::vector<RecordedTransaction>& history)
      : history_(history), graph_(history.size()) {}

  std::optional<Finding> run() {
    for (std::uint32_t writer = 0; writer < history_.size(); ++writer) {
      for (const Append& append : history_[writer].appends)
        writers_[append.value] = writer;
    }
    for (std::uint32_t reader = 0; reader < history_.size(); ++reader) {
      if (!history_[reader].committed) continue;
      for (const ListRead& read : history_[reader].reads)
        check_read(reader, read);
    }
    check_lost_appends();
    add_dependencies();
    add_real_time();
    if (const auto cycle = find_cycle(graph_); !cycle.empty()) {
      std::string text = "cycle: " + name(cycle.front().from);
      for (const Edge& edge : cycle)
        text += " -> " + std::to_string(edge.to) + " (" + edge.reason + ")";
      report(Anomaly::cycle, text);
    }
    return std::move(first_);
  }

 private:
  void report(Anomaly anomaly, std::string text) {
    if (!first_) first_ = Finding{anomaly, std::move(text)};
  }

  static std::string name(std::uint32_t transaction) { return "transaction " + std::to_string(transaction); }
  static std::string name(Key key, Value value) {
    return "value " + std::to_string(value) + " of list " + std::to_string(key);
  }

  std::uint32_t writer_of(Value value) const {
    const auto found = writers_.find(value);
    return found == writers_.end() ? no_transaction : found->second;
  }

  void check_read(std::uint32_t reader, const ListRead& read) {
    const std::string by = ", read by " + name(reader) + ", ";
    std::unordered_set<Value> seen;
    for (const Value value : read.values) {
      const std::uint32_t writer = writer_of(value);
      if (!seen.insert(value).second)
        report(Anomaly::repeated_value, name(read.key, value) + by + "is repeated");
      if (writer == no_transaction) {
        report(Anomaly::unwritten_value, name(read.key, value) + by + "was not appended");
      } else if (!history_[writer].committed) {
        report(Anomaly::aborted_read, name(read.key, value) + by + "is of uncommitted " + name(writer));
      }
    }
    for (const Value value : read.values) {
      const std::uint32_t writer = writer_of(value);
      if (writer == no_transaction) continue;
      for (const Append& append : history_[writer].appends) {
        if (append.key == read.key && !seen.contains(append.value))
          report(Anomaly::partial_read, name(read.key, append.value) + " of " + name(writer) +
                                            " is missing in the read by " + name(reader));
      }
    }
    check_appends_of_reader(reader, read);
    check_order(reader, read);
  }

  void check_appends_of_reader(std::uint32_t reader, const ListRead& read) {
    std::vector<Value> appended;
    for (const Append& append : history_[reader].appends)
      if (append.key == read.key) appended.push_back(append.value);
    const bool valid = history_[reader].reads_before_appends
                           ? std::ranges::find_first_of(read.values, appended) == read.values.end()
                           : appended.size() <= read.values.size() &&
                                 std::equal(appended.rbegin(), appended.rend(), read.values.rbegin());
    if (!valid)
      report(Anomaly::misplaced_appends,
             name(reader) + " does not read its appends to list " + std::to_string(read.key) + " at the end");
  }

  void check_order(std::uint32_t reader, const ListRead& read) {
    List& list = lists_[read.key];
    const auto common = static_cast<std::ptrdiff_t>(std::min(list.values.size(), read.values.size()));
    if (!std::equal(read.values.begin(), read.values.begin() + common, list.values.begin())) {
      report(Anomaly::conflicting_reads, "list " + std::to_string(read.key) + " has different orders for " +
                                             name(list.read_by) + " and " + name(reader));
    } else if (read.values.size() > list.values.size()) {
      list = {read.values, reader};
    }
  }

  void check_lost_appends() {
    std::unordered_set<Value> read;
    for (const auto& [key, list] : lists_)
      read.insert(list.values.begin(), list.values.end());
    for (std::uint32_t writer = 0; writer < history_.size(); ++writer) {
      for (const Append& append : history_[writer].appends) {
        if (history_[writer].committed && !read.contains(append.value))
          report(Anomaly::lost_append, name(append.key, append.value) + " of " + name(writer) + " is lost");
      }
    }
  }

  void add_edge(std::uint32_t from, std::uint32_t to, const char* reason) {
    if (from != to && from != no_transaction && to != no_transaction)
      graph_[from].push_back({from, to, reason});
  }

  void add_dependencies() {
    for (const auto& [key, list] : lists_) {
      for (std::size_t k = 1; k < list.values.size(); ++k)
        add_edge(writer_of(list.values[k - 1]), writer_of(list.values[k]), "appends after it");
    }
    for (std::uint32_t reader = 0; reader < history_.size(); ++reader) {
      if (!history_[reader].committed) continue;
      for (const ListRead& read : history_[reader].reads) {
        const List& list = lists_[read.key];
        if (!read.values.empty()) add_edge(writer_of(read.values.back()), reader, "reads its append");
        if (read.values.size() < list.values.size())
          add_edge(reader, writer_of(list.values[read.values.size()]), "appends after its read");
      }
    }
  }

  /// A transaction that ended before another one began is before it. The edges from the latest ones that
  /// ended are enough.
  void add_real_time() {
    std::vector<std::uint32_t> by_begin;
    for (std::uint32_t k = 0; k < history_.size(); ++k)
      if (history_[k].committed && !history_[k].reads_old_version) by_begin.push_back(k);
    std::vector<std::uint32_t> by_end = by_begin;
    std::ranges::sort(by_begin, {}, [&](std::uint32_t k) { return history_[k].begun_ns; });
    std::ranges::sort(by_end, {}, [&](std::uint32_t k) { return history_[k].ended_ns; });
    std::vector<std::uint32_t> latest;
    std::size_t next = 0;
    for (const std::uint32_t k : by_begin) {
      for (; next < by_end.size() && history_[by_end[next]].ended_ns < history_[k].begun_ns; ++next) {
        const std::uint32_t ended = by_end[next];
        std::erase_if(latest, [&](std::uint32_t before) {
          return history_[before].ended_ns < history_[ended].begun_ns;
        });
        latest.push_back(ended);
      }
      for (const std::uint32_t before : latest)
        add_edge(before, k, "begins after its end");
    }
  }

  const std::vector<RecordedTransaction>& history_;
  std::unordered_map<Value, std::uint32_t> writers_;
  std::map<Key, List> lists_;
  Graph graph_;
  std::optional<Finding> first_;
};

}  // namespace

std::optional<Finding> find_anomaly(const std::vector<RecordedTransaction>& history) {
  return Search(history).run();
}

}  // namespace hil::long_test
