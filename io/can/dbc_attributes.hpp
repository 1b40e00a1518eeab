#pragma once
// The attributes of a DBC file that determine how messages are transmitted, and the long names.

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/can/dbc_draft.hpp"

namespace hil::io::can {

class DbcAttributes {
 public:
  /// The words of an attribute that BA_DEF_ defines as an ENUM.
  std::vector<std::string>& words_of(const std::string& name) { return definitions_[name].words; }
  /// The value of BA_DEF_DEF_.
  void set_default(const std::string& name, DbcAttributeValue value);

  /// BA_ of a message, a signal or a node. Ignores attributes that hil does not use. `position`: of the
  /// statement.
  void set_of_message(std::string_view name, std::uint32_t file_id, const DbcAttributeValue& value,
                      std::size_t position, DbcDraft& draft, DbcProblems& problems);
  void set_of_signal(std::string_view name, std::uint32_t file_id, std::string_view signal,
                     const DbcAttributeValue& value, std::size_t position, DbcDraft& draft,
                     DbcProblems& problems);
  void set_of_node(std::string_view name, std::string_view node, const DbcAttributeValue& value);

  /// At the end of the file: applies values and defaults to a message, and long names to the database.
  void apply_to(DbcMessage& message, const DbcMessageNote& note, DbcProblems& problems);
  void apply_long_names(DbcDraft& draft, DbcProblems& problems);

 private:
  /// The contents of BA_DEF_ and BA_DEF_DEF_ for one attribute.
  struct Definition {
    std::vector<std::string> words;  ///< of an ENUM
    std::optional<DbcAttributeValue> initial;
  };
  enum class FrameFormat : std::uint8_t { unstated, classic, fd, j1939 };

  FrameFormat format_of(const DbcAttributeValue& value);
  bool switches_bit_rate(const DbcAttributeValue& value);

  std::map<std::string, Definition, std::less<>> definitions_;
  std::map<std::string, std::string, std::less<>> long_node_names_;
};

}  // namespace hil::io::can
