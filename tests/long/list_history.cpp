#include "tests/long/list_history.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "tests/long/cycles.hpp"

namespace hil::stress {

namespace {

constexpr std::uint32_t nobody = 0xFFFFFFFFu;

/// What is known of one list: the longest read, which all others must be a beginning of.
struct List {
  std::vector<Value> values;
  std::uint32_t read_by = nobody;
};

class Search {
 public:
  Search(const std::vector<Recorded>& history, const HistoryOptions& options)
      : history_(history), options_(options), graph_(history.size()) {}

  std::vector<Finding> run() {
    note_writers();
    for (std::uint32_t reader = 0; reader < history_.size(); ++reader) {
      if (history_[reader].ending != Ending::committed) continue;
      for (const ListRead& read : history_[reader].reads)
        look_at(reader, read);
    }
    note_observed();
    if (options_.final_reads) look_for_lost_appends();
    order_by_lists();
    order_by_real_time();
    name_cycles();
    return std::move(findings_);
  }

 private:
  void found(Anomaly anomaly, std::string what) {
    if (findings_.size() < options_.max_findings) findings_.push_back({anomaly, std::move(what)});
  }

  static std::string name(std::uint32_t transaction) { return "transaction " + std::to_string(transaction); }
  static std::string of_list(Key key) { return " of list " + std::to_string(key); }

  void note_writers() {
    for (std::uint32_t writer = 0; writer < history_.size(); ++writer) {
      for (const Append& append : history_[writer].appends)
        writers_[append.value] = writer;
    }
  }

  std::uint32_t writer_of(Value value) const {
    const auto found = writers_.find(value);
    return found == writers_.end() ? nobody : found->second;
  }

  void look_at(std::uint32_t reader, const ListRead& read) {
    std::unordered_set<Value> seen;
    for (const Value value : read.values) {
      const std::uint32_t writer = writer_of(value);
      const std::string place =
          "value " + std::to_string(value) + of_list(read.key) + ", read by " + name(reader);
      if (!seen.insert(value).second) found(Anomaly::value_twice, place);
      if (writer == nobody) {
        found(Anomaly::unwritten_value, place);
      } else if (history_[writer].ending == Ending::nothing_done) {
        found(Anomaly::aborted_read, place + ", of " + name(writer) + ", which came to nothing");
      }
    }
    look_at_own(reader, read);
    look_for_halves(reader, read, seen);
    continue_list(reader, read);
  }

  void look_at_own(std::uint32_t reader, const ListRead& read) {
    std::vector<Value> own;
    for (const Append& append : history_[reader].appends)
      if (append.key == read.key) own.push_back(append.value);
    if (history_[reader].reads_come_first) {
      const auto too_early = std::ranges::find_first_of(read.values, own);
      if (too_early != read.values.end())
        found(Anomaly::own_appends_misplaced, name(reader) + of_list(read.key));
      return;
    }
    const bool ends_with_own =
        own.size() <= read.values.size() && std::equal(own.rbegin(), own.rend(), read.values.rbegin());
    if (!ends_with_own) found(Anomaly::own_appends_misplaced, name(reader) + of_list(read.key));
  }

  void look_for_halves(std::uint32_t reader, const ListRead& read, const std::unordered_set<Value>& seen) {
    for (const Value value : read.values) {
      const std::uint32_t writer = writer_of(value);
      if (writer == nobody) continue;
      for (const Append& other : history_[writer].appends) {
        if (other.key != read.key || seen.contains(other.value)) continue;
        found(Anomaly::half_read, name(reader) + " read value " + std::to_string(value) + " and not " +
                                      std::to_string(other.value) + of_list(read.key) + ", both of " +
                                      name(writer));
        return;
      }
    }
  }

  void continue_list(std::uint32_t reader, const ListRead& read) {
    List& list = lists_[read.key];
    const std::size_t common = std::min(list.values.size(), read.values.size());
    if (!std::equal(read.values.begin(), read.values.begin() + static_cast<std::ptrdiff_t>(common),
                    list.values.begin())) {
      found(Anomaly::lists_disagree,
            "reads" + of_list(read.key) + " by " + name(list.read_by) + " and " + name(reader));
      return;
    }
    if (read.values.size() > list.values.size()) list = {read.values, reader};
  }

  void note_observed() {
    for (const auto& [key, list] : lists_) {
      for (const Value value : list.values)
        if (const std::uint32_t writer = writer_of(value); writer != nobody) observed_.insert(writer);
    }
  }

  void look_for_lost_appends() {
    std::unordered_set<Value> all;
    for (const auto& [key, list] : lists_)
      all.insert(list.values.begin(), list.values.end());
    for (std::uint32_t writer = 0; writer < history_.size(); ++writer) {
      const Recorded& recorded = history_[writer];
      const bool must_be_there = recorded.ending == Ending::committed ||
                                 (recorded.ending == Ending::unknown && observed_.contains(writer));
      for (const Append& append : recorded.appends) {
        if (must_be_there && !all.contains(append.value))
          found(Anomaly::append_lost, "value " + std::to_string(append.value) + of_list(append.key) +
                                          ", appended by " + name(writer));
      }
    }
  }

  bool counts(std::uint32_t transaction) const {
    return history_[transaction].ending == Ending::committed || observed_.contains(transaction);
  }

  void order_by_lists() {
    std::map<Key, std::unordered_map<Value, std::size_t>> places;
    for (const auto& [key, list] : lists_) {
      auto& of_key = places[key];
      for (std::size_t k = 0; k < list.values.size(); ++k) {
        of_key.emplace(list.values[k], k);
        if (k > 0)
          graph_.add(writer_of(list.values[k - 1]), writer_of(list.values[k]), Dependency::write_write);
      }
    }
    for (std::uint32_t reader = 0; reader < history_.size(); ++reader) {
      if (history_[reader].ending != Ending::committed) continue;
      for (const ListRead& read : history_[reader].reads) {
        const List& list = lists_[read.key];
        if (!read.values.empty()) graph_.add(writer_of(read.values.back()), reader, Dependency::write_read);
        if (read.values.size() < list.values.size())
          graph_.add(reader, writer_of(list.values[read.values.size()]), Dependency::read_write);
      }
    }
  }

  /// Who had ended before another began goes before it. An edge from each of those that ended last is enough.
  void order_by_real_time() {
    std::vector<std::uint32_t> by_begin;
    for (std::uint32_t k = 0; k < history_.size(); ++k)
      if (counts(k) && !history_[k].reads_the_past) by_begin.push_back(k);
    std::vector<std::uint32_t> by_end;
    for (const std::uint32_t k : by_begin)
      if (history_[k].ending == Ending::committed) by_end.push_back(k);
    std::ranges::sort(by_begin, {}, [&](std::uint32_t k) { return history_[k].begun_ns; });
    std::ranges::sort(by_end, {}, [&](std::uint32_t k) { return history_[k].ended_ns; });
    std::vector<std::uint32_t> ended_last;
    std::size_t next = 0;
    for (const std::uint32_t k : by_begin) {
      for (; next < by_end.size() && history_[by_end[next]].ended_ns < history_[k].begun_ns; ++next) {
        const std::uint32_t one = by_end[next];
        std::erase_if(ended_last,
                      [&](std::uint32_t other) { return history_[other].ended_ns < history_[one].begun_ns; });
        ended_last.push_back(one);
      }
      for (const std::uint32_t before : ended_last)
        graph_.add(before, k, Dependency::real_time);
    }
  }

  /// The least set of dependencies that has a cycle names the anomaly.
  void name_cycles() {
    constexpr unsigned ww = bit(Dependency::write_write);
    constexpr unsigned wr = bit(Dependency::write_read);
    constexpr unsigned rw = bit(Dependency::read_write);
    constexpr unsigned all = ww | wr | rw | bit(Dependency::real_time);
    constexpr std::array<std::pair<Anomaly, unsigned>, 3> kinds{
        {{Anomaly::write_cycle, ww},
         {Anomaly::information_cycle, ww | wr},
         {Anomaly::antidependency_cycle, ww | wr | rw}}};
    for (const auto& [anomaly, dependencies] : kinds) {
      const auto cycle = graph_.cycle(dependencies);
      if (cycle.empty()) continue;
      const auto antidependencies = std::ranges::count_if(
          cycle, [](const Edge& edge) { return edge.dependency == Dependency::read_write; });
      found(antidependencies == 1 ? Anomaly::single_antidependency_cycle : anomaly, describe(cycle));
      return;
    }
    if (const auto cycle = graph_.cycle(all); !cycle.empty())
      found(Anomaly::against_real_time, describe(cycle));
  }

  const std::vector<Recorded>& history_;
  const HistoryOptions& options_;
  std::unordered_map<Value, std::uint32_t> writers_;
  std::map<Key, List> lists_;
  std::unordered_set<std::uint32_t> observed_;  ///< whose appends somebody read
  DependencyGraph graph_;
  std::vector<Finding> findings_;
};

}  // namespace

const char* to_string(Anomaly anomaly) {
  switch (anomaly) {
    case Anomaly::unwritten_value:
      return "a value that nobody appended";
    case Anomaly::value_twice:
      return "a value twice";
    case Anomaly::aborted_read:
      return "a read of what came to nothing (G1a)";
    case Anomaly::half_read:
      return "a read of half a transaction (G1b)";
    case Anomaly::own_appends_misplaced:
      return "own appends not where they should be seen";
    case Anomaly::lists_disagree:
      return "reads that disagree on the order";
    case Anomaly::append_lost:
      return "an append that was lost";
    case Anomaly::write_cycle:
      return "a cycle of writes (G0)";
    case Anomaly::information_cycle:
      return "a cycle of writes and reads (G1c)";
    case Anomaly::single_antidependency_cycle:
      return "a cycle with one antidependency (G-single)";
    case Anomaly::antidependency_cycle:
      return "a cycle with antidependencies (G2)";
    case Anomaly::against_real_time:
      return "an order against real time";
  }
  return "?";
}

std::vector<Finding> find_anomalies(const std::vector<Recorded>& history, const HistoryOptions& options) {
  return Search(history, options).run();
}

}  // namespace hil::stress
