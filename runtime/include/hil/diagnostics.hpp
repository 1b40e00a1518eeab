#pragma once
// Mistakes and warnings about a user's files, collected so that all of them are shown at once.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hil::config {

/// A place in a file. Lines and columns (in characters) count from 1; 0: the file as a whole.
struct Place {
  std::string file;
  std::uint32_t line = 0;
  std::uint32_t column = 0;

  bool operator==(const Place&) const = default;
};

/// A word of a user's file that is looked up later, with its place.
struct Word {
  std::string text;
  Place place;
};

struct Mistake {
  Place place;
  std::string message;  ///< one sentence: what is wrong, with the value as written, and what would be right
};

/// A mistake refuses the file. A warning does not: it has no part in empty(), count() and mistakes().
///
/// One thread.
class Diagnostics {
 public:
  /// The number of mistakes, and of warnings, that are kept; further ones are counted, and to_text reports
  /// their number.
  static constexpr std::size_t capacity = 1000;

  void add(Place place, std::string message);
  /// Adds a warning: the file can be used, but likely does not do what its author intends.
  void warn(Place place, std::string message);
  bool empty() const noexcept { return count_ == 0; }
  bool full() const noexcept { return count_ >= capacity; }
  /// All mistakes added, those beyond the capacity too.
  std::size_t count() const noexcept { return count_; }
  /// In the order they were added.
  const std::vector<Mistake>& mistakes() const noexcept { return mistakes_; }
  /// All warnings added, those beyond the capacity too.
  std::size_t warning_count() const noexcept { return warning_count_; }
  /// In the order they were added.
  const std::vector<Mistake>& warnings() const noexcept { return warnings_; }
  /// For the limit of all delays together: notes that the expression at `place` delays a value by `steps`.
  /// Returns the sum over all places; an expression that is compiled again counts once.
  std::uint64_t add_delay(const Place& place, std::uint64_t steps);
  /// One mistake per line as "file:line:column: message", one warning as "file:line:column: warning:
  /// message", in file order; files in the order of their first mistake, then of their first warning.
  std::string to_text() const;

 private:
  std::vector<Mistake> mistakes_;
  std::vector<Mistake> warnings_;
  std::vector<std::pair<Place, std::uint64_t>> delays_;
  std::uint64_t delay_steps_ = 0;
  std::size_t count_ = 0;
  std::size_t warning_count_ = 0;
};

/// The candidate nearest to `word` (Damerau-Levenshtein, case ignored), or empty when none is near enough to
/// be meant: as a rule one slip per three letters, at most three. Of equally near ones, the first. A word
/// above 255 letters is near to nothing.
std::string nearest(std::string_view word, const std::vector<std::string>& candidates);

/// "; did you mean 'x'?" for the nearest candidate; else "; known here: a, b, c"; empty when there are no
/// candidates.
std::string suggestion(std::string_view word, const std::vector<std::string>& candidates);

/// For a short list that is shown completely: "; did you mean 'b'? Known here: b, a, c", the nearest
/// candidate first; without a near one "; known here: a, b, c".
std::string all_known(std::string_view word, const std::vector<std::string>& candidates);

/// The user's text in single quotes, shortened when it is long, with unprintable bytes shown as '?'.
std::string in_quotes(std::string_view text);

}  // namespace hil::config
