#pragma once
// Mistakes in a user's files, collected so that all of them are shown at once.

#include <cstdint>
#include <string>
#include <vector>

namespace hil::config {

/// A place in a file. Lines and columns count from 1; 0: the file as a whole.
struct Place {
  std::string file;
  std::uint32_t line = 0;
  std::uint32_t column = 0;
};

struct Mistake {
  Place place;
  std::string message;  ///< one sentence: what is wrong, with the value as written, and what would be right
};

class Diagnostics {
 public:
  void add(Place place, std::string message);
  bool empty() const noexcept { return mistakes_.empty(); }
  const std::vector<Mistake>& mistakes() const noexcept { return mistakes_; }
  /// One mistake per line as "file:line:column: message", in file order.
  std::string to_text() const;

 private:
  std::vector<Mistake> mistakes_;
};

/// The candidate nearest to `word` (Damerau-Levenshtein, case ignored), or empty when none is near enough to
/// be meant.
std::string nearest(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace hil::config
