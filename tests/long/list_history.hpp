#pragma once
// What clients of a database did and saw, and whether one serial order explains it.
//
// The objects are lists that can only be appended to and read whole. Every appended value is another one, so
// a list that was read tells in which order the transactions before it wrote, whatever the database says of
// itself; that makes every transaction's place recoverable from what was seen alone (Kingsbury and Alvaro
// 2020, "Elle: Inferring Isolation Anomalies from Experimental Observations"). Strict serializability is
// asked for: the order must also agree with real time, except for transactions that chose to read the past.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace hil::stress {

using Key = std::uint32_t;
using Value = std::uint32_t;

struct Append {
  Key key = 0;
  Value value = 0;
};

struct ListRead {
  Key key = 0;
  std::vector<Value> values;
};

enum class Ending : std::uint8_t {
  committed,
  nothing_done,  ///< its appends must never be seen
  unknown,       ///< nobody was told: its appends may be seen or not, but all or none
};

/// One transaction: its appends in order, and its reads, which see them; or, where reads come first, do not.
struct Recorded {
  std::int64_t begun_ns = 0;  ///< on one clock for all clients: before it was handed over
  std::int64_t ended_ns = 0;  ///< after its outcome was there
  Ending ending = Ending::committed;
  bool reads_the_past = false;  ///< asked for an older version: real time says nothing about its place
  bool reads_come_first = false;
  std::vector<Append> appends;
  std::vector<ListRead> reads;
};

enum class Anomaly : std::uint8_t {
  unwritten_value,        ///< a value that nobody appended
  value_twice,            ///< in one list
  aborted_read,           ///< G1a: a value of a transaction that came to nothing
  half_read,              ///< G1b: some of a transaction's appends to one list and not all
  own_appends_misplaced,  ///< a transaction's read does not end with what it appended itself, or shows it too early
  lists_disagree,         ///< two reads of one list of which neither continues the other
  append_lost,            ///< committed, and not in a later read that should hold it (only with final reads)
  write_cycle,            ///< G0
  information_cycle,            ///< G1c
  single_antidependency_cycle,  ///< G-single: read skew, lost update
  antidependency_cycle,         ///< G2: write skew
  against_real_time,            ///< a cycle that only real time closes
};

const char* to_string(Anomaly anomaly);

struct Finding {
  Anomaly anomaly{};
  std::string what;  ///< with the ordinals of the transactions
};

struct HistoryOptions {
  /// The last transactions of the history read every list after all appends had ended: a committed append
  /// that no read holds is lost.
  bool final_reads = true;
  std::size_t max_findings = 20;
};

/// All that no serial order explains; empty: there is one.
std::vector<Finding> find_anomalies(const std::vector<Recorded>& history, const HistoryOptions& options = {});

}  // namespace hil::stress
