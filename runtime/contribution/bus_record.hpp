#pragma once
// What the buses of a run contribute to its report: counters and other facts of each, the columns of the
// table in which the page shows them, and sentences on faults. The report writes and draws them without
// knowing the type of bus.
//
// A double that is not known is NaN; files hold null for it and the page shows a dash. Threads: plain data.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace hil::contribution {

/// A row of a list inside a record: an exception code and its count.
using BusRow = std::vector<std::pair<std::string, std::variant<std::uint64_t, std::string>>>;

/// One key of a bus in report.json. A double is a share: the page shows it in per cent.
struct BusField {
  std::string key;
  std::variant<std::uint64_t, double, std::string, std::vector<BusRow>> value;
};

/// A sentence on something that happened `count` times: "3 frames are missing in the log".
struct BusSentence {
  std::uint64_t count = 0;
  std::string text{};  ///< the whole sentence, with the count, without a full stop
};

/// "3 frames are missing in the log". Adds nothing when the count is zero. The subjects have the verb if it
/// differs: "frame is", "frames are".
inline void add_sentence(std::vector<BusSentence>& sentences, std::uint64_t count,
                         const std::string& singular, const std::string& plural,
                         const std::string& predicate) {
  if (count == 0) return;
  sentences.push_back(
      {count, std::to_string(count) + ' ' + (count == 1 ? singular : plural) + ' ' + predicate});
}

/// "the connection was restored 3 times". Adds nothing when the count is zero.
inline void add_repetition(std::vector<BusSentence>& sentences, std::uint64_t count,
                           const std::string& sentence) {
  if (count == 0) return;
  sentences.push_back({count, sentence + ' ' + (count == 1 ? "once" : std::to_string(count) + " times")});
}

struct BusRecord {
  std::string name{};
  std::vector<BusField> fields{};      ///< in the order of the file, behind the name
  std::vector<BusSentence> faults{};   ///< for the console and the page
  std::vector<BusSentence> remarks{};  ///< for the page alone
  /// Ticks whose outputs were not sent, which realtime.max_lost limits; empty: the type does not count them.
  /// Only in memory; a type that counts them has a field for them too.
  std::optional<std::uint64_t> dropped_releases{};

  /// Null: it has no field with this key.
  const BusField* find(const std::string& key) const {
    for (const BusField& field : fields) {
      if (field.key == key) return &field;
    }
    return nullptr;
  }
};

/// A column of the table on the page.
struct BusColumn {
  std::string key{};  ///< of the field that it shows, or of the name
  std::string title{};
  bool is_fault = false;  ///< a count other than zero is shown as a fault
};

/// The buses of one type. Every field that a column shows is in each record.
struct BusGroup {
  std::string list_key{};  ///< of their list in report.json, and in a scenario: "can"
  std::string title{};     ///< of the table: "CAN"
  std::string name_key{};  ///< of the name in each record: "bus"
  std::vector<BusColumn> columns{};
  std::vector<BusRecord> buses{};
};

}  // namespace hil::contribution
