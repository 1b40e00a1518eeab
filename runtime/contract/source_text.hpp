#pragma once
// The text of one file, or of one --set option. It is kept as long as a value read from it, so that error
// texts can name places in it.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <hil/diagnostics.hpp>

namespace hil::config {

/// A file above this size is refused before it is read. It bounds the time in the YAML library, which for the
/// worst texts needs about a microsecond per byte.
inline constexpr std::size_t max_file_bytes = std::size_t{1024} * 1024;

/// A position as the YAML library counts it: lines and bytes of the line, from 0.
struct TextPosition {
  std::uint32_t line = 0;
  std::uint32_t byte = 0;
};

class SourceText {
 public:
  /// `directory`: where relative paths written in this text start.
  SourceText(std::string name, std::string directory, std::string text);

  const std::string& name() const noexcept { return name_; }
  const std::string& directory() const noexcept { return directory_; }
  const std::string& text() const noexcept { return text_; }

  /// Columns of a Place count characters, not bytes. A position behind the end gives the end.
  Place place(TextPosition position) const;
  std::size_t offset(TextPosition position) const;
  TextPosition position(std::size_t offset) const;

  /// The position behind the anchor that stands at `begin`, or `begin` when none does.
  TextPosition behind_anchor(TextPosition begin) const;
  /// False when the quotation mark at `begin` has no closing one. (The YAML library takes the end of the file
  /// for it.)
  bool is_closed(TextPosition begin) const;

  /// Where character `index` of `scalar` stands when the scalar begins at `begin`: inside quotes, behind
  /// escapes, in folded lines and in block scalars. `begin` itself when the place is not known.
  Place place_in_scalar(TextPosition begin, std::string_view scalar, std::size_t index) const;

 private:
  static constexpr std::size_t block_bytes = 64;

  std::uint32_t characters_before(std::size_t offset) const;

  std::string name_;
  std::string directory_;
  std::string text_;
  std::vector<std::size_t> line_starts_;
  std::vector<std::uint32_t>
      characters_before_block_;  ///< so that a place in a long line costs no walk along it
};

/// Reads a regular file of at most max_file_bytes and takes a byte order mark off. Null with a mistake:
/// missing, not a regular file, unreadable, too large.
std::shared_ptr<const SourceText> read_source(const std::string& path, Diagnostics& diagnostics);

/// The same for text that is no file: the size limit holds, relative paths start at the current directory.
std::shared_ptr<const SourceText> source_of_text(const std::string& name, std::string_view text,
                                                 Diagnostics& diagnostics);

/// Refuses invalid UTF-8, control characters and indentation by tabs. Each tab is a mistake of its own; the
/// first two end the search, since the file is probably not text. Returns true when none was found.
bool check_source(const SourceText& source, Diagnostics& diagnostics);

}  // namespace hil::config
