#pragma once
// What the buses of a run contribute to its report: counters and other facts of each, the columns of the
// table in which the page shows them, and sentences on faults. The report writes and draws them without
// knowing the type of bus.
//
// A double that is not known is NaN; files hold null for it and the page shows a dash. Threads: plain data.

#include <cstdint>
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

/// "3 frames missing in the log": the count with its noun, then the words.
struct BusSentence {
  std::uint64_t count = 0;
  std::string one{};    ///< the noun: "frame"
  std::string many{};   ///< "frames"
  std::string words{};  ///< without a full stop
};

/// Adds the sentence unless the count is zero.
inline void add_sentence(std::vector<BusSentence>& sentences, std::uint64_t count, std::string one,
                         std::string many, std::string words) {
  if (count > 0) sentences.push_back({count, std::move(one), std::move(many), std::move(words)});
}

/// The key of the number of ticks whose outputs were not sent, which realtime.max_lost limits.
inline constexpr const char* dropped_releases_key = "dropped_releases";

struct BusRecord {
  std::string name{};
  std::vector<BusField> fields{};      ///< in the order of the file, behind the name
  std::vector<BusSentence> faults{};   ///< for the console and the page
  std::vector<BusSentence> remarks{};  ///< for the page alone

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
  std::string section{};   ///< the key of their list in report.json, and in a scenario: "can"
  std::string title{};     ///< of the table: "CAN"
  std::string name_key{};  ///< of the name in each record: "bus"
  std::vector<BusColumn> columns{};
  std::vector<BusRecord> buses{};
};

}  // namespace hil::contribution
