#pragma once
// The transactions of several clients of a database, and a check whether one serial order explains them.
//
// The objects are lists that clients append to and read whole. All appended values differ, so a list that was
// read shows the order of the transactions that wrote it, independently of what the database reports
// (Kingsbury and Alvaro 2020, "Elle: Inferring Isolation Anomalies from Experimental Observations"). The
// check is strict serializability: the order agrees with real time, except for transactions that read an old
// version on purpose.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace hil::long_test {

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

/// One transaction: its appends in order, and its reads, which include these appends.
struct RecordedTransaction {
  std::int64_t begun_ns = 0;  ///< on one clock for all clients: before it was submitted
  std::int64_t ended_ns = 0;  ///< after its outcome was known
  bool committed = true;      ///< false: no read may show its appends
  bool reads_old_version = false;
  bool reads_before_appends = false;  ///< the reads do not include the appends
  std::vector<Append> appends;
  std::vector<ListRead> reads;
};

enum class Anomaly : std::uint8_t {
  unwritten_value,    ///< a value that no transaction appended
  repeated_value,     ///< in one list
  aborted_read,       ///< G1a: a value of a transaction that did not commit
  partial_read,       ///< G1b: some of a transaction's appends to one list and not all
  misplaced_appends,  ///< a read does not end with the appends of its transaction, or shows them too early
  conflicting_reads,  ///< two reads of one list of which neither continues the other
  lost_append,        ///< committed, and in no read
  cycle,              ///< of dependencies and real time: G0, G1c, G-single, G2, or a stale read
};

struct Finding {
  Anomaly anomaly{};
  std::string text;  ///< with the numbers of the transactions
};

/// The first anomaly; none: one serial order explains the history. The last transactions of the history read
/// every list after all appends.
std::optional<Finding> find_anomaly(const std::vector<RecordedTransaction>& history);

}  // namespace hil::long_test
