#include <algorithm>
#include <array>
#include <tuple>
#include <unordered_map>
#include <utility>

#include <hil/diagnostics.hpp>

namespace hil::config {
namespace {

constexpr std::size_t longest_word = 255;

char lower(char letter) {
  return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter;
}

std::size_t allowed_slips(std::size_t letters) {
  return std::min<std::size_t>(3, (letters + 2) / 3);
}

/// The Damerau-Levenshtein distance of two words of at most longest_word letters.
std::size_t distance(std::string_view from, std::string_view to) {
  using Row = std::array<std::size_t, longest_word + 1>;
  std::array<Row, 3> rows{};
  for (std::size_t column = 0; column <= to.size(); ++column)
    rows[0][column] = column;
  for (std::size_t i = 1; i <= from.size(); ++i) {
    Row& row = rows[i % 3];
    const Row& above = rows[(i - 1) % 3];
    const Row& two_above = rows[(i + 1) % 3];
    row[0] = i;
    for (std::size_t j = 1; j <= to.size(); ++j) {
      const std::size_t replaced = above[j - 1] + (lower(from[i - 1]) == lower(to[j - 1]) ? 0 : 1);
      row[j] = std::min({above[j] + 1, row[j - 1] + 1, replaced});
      const bool swapped =
          i > 1 && j > 1 && lower(from[i - 1]) == lower(to[j - 2]) && lower(from[i - 2]) == lower(to[j - 1]);
      if (swapped) row[j] = std::min(row[j], two_above[j - 2] + 1);
    }
  }
  return rows[from.size() % 3][to.size()];
}

/// In single quotes, at most `longest_shown` bytes, with '?' for unprintable ones.
std::string quoted(std::string_view text, std::size_t longest_shown) {
  const bool shortened = text.size() > longest_shown;
  std::size_t length = std::min(text.size(), longest_shown);
  // Never cut a character in two.
  while (shortened && length > 0 && (static_cast<unsigned char>(text[length]) & 0xC0U) == 0x80U)
    --length;
  std::string shown = "'";
  for (const char letter : text.substr(0, length)) {
    const auto byte = static_cast<unsigned char>(letter);
    shown += byte < 0x20U || byte == 0x7FU ? '?' : letter;
  }
  return shown + (shortened ? "...'" : "'");
}

}  // namespace

void Diagnostics::add(Place place, std::string message) {
  ++count_;
  if (mistakes_.size() < capacity) mistakes_.push_back({std::move(place), std::move(message)});
}

void Diagnostics::warn(Place place, std::string message) {
  ++warning_count_;
  if (warnings_.size() < capacity) warnings_.push_back({std::move(place), std::move(message)});
}

std::uint64_t Diagnostics::add_delay(const Place& place, std::uint64_t steps) {
  const auto is_there = [&](const auto& delay) { return delay.first == place; };
  if (std::ranges::none_of(delays_, is_there)) {
    delays_.emplace_back(place, steps);
    delay_steps_ += steps;
  }
  return delay_steps_;
}

std::string Diagnostics::to_text() const {
  struct Line {
    const Mistake* mistake;
    const char* severity;
  };
  std::vector<Line> lines;
  lines.reserve(mistakes_.size() + warnings_.size());
  for (const Mistake& mistake : mistakes_)
    lines.push_back({&mistake, ""});
  for (const Mistake& warning : warnings_)
    lines.push_back({&warning, " warning:"});
  std::unordered_map<std::string, std::size_t> file_order;
  for (const Line& line : lines)
    file_order.try_emplace(line.mistake->place.file, file_order.size());
  std::stable_sort(lines.begin(), lines.end(), [&](const Line& left, const Line& right) {
    const Place& a = left.mistake->place;
    const Place& b = right.mistake->place;
    return std::tuple(file_order.at(a.file), a.line, a.column) <
           std::tuple(file_order.at(b.file), b.line, b.column);
  });
  std::string text;
  for (const auto& [mistake, severity] : lines) {
    text += mistake->place.file + ":";
    if (mistake->place.line > 0)
      text += std::to_string(mistake->place.line) + ":" + std::to_string(mistake->place.column) + ":";
    text += severity;
    text += " " + mistake->message + "\n";
  }
  if (count_ > mistakes_.size()) {
    text += std::to_string(count_ - mistakes_.size()) + " more mistakes are not shown\n";
  }
  if (warning_count_ > warnings_.size()) {
    text += std::to_string(warning_count_ - warnings_.size()) + " more warnings are not shown\n";
  }
  return text;
}

std::string nearest(std::string_view word, const std::vector<std::string>& candidates) {
  if (word.empty() || word.size() > longest_word) return {};
  const std::size_t allowed = allowed_slips(word.size());
  std::size_t best = allowed + 1;
  const std::string* found = nullptr;
  for (const std::string& candidate : candidates) {
    if (candidate.size() > word.size() + allowed || word.size() > candidate.size() + allowed) continue;
    if (candidate.size() > longest_word) continue;
    const std::size_t slips = distance(word, candidate);
    if (slips < best && slips < std::max(word.size(), candidate.size())) {
      best = slips;
      found = &candidate;
    }
  }
  return found != nullptr ? *found : std::string();
}

std::string suggestion(std::string_view word, const std::vector<std::string>& candidates) {
  constexpr std::size_t max_listed = 24;
  if (candidates.empty()) return {};
  const std::string near = nearest(word, candidates);
  if (!near.empty()) return "; did you mean " + quoted(near, longest_word) + "?";
  std::string list = "; known here: ";
  for (std::size_t i = 0; i < std::min(candidates.size(), max_listed); ++i) {
    list += (i == 0 ? "" : ", ") + candidates[i];
  }
  return candidates.size() > max_listed ? list + ", ..." : list;
}

std::string all_known(std::string_view word, const std::vector<std::string>& candidates) {
  const std::string near = nearest(word, candidates);
  std::string list = near.empty() ? "; known here: "
                                  : "; did you mean " + quoted(near, longest_word) + "? Known here: " + near;
  bool first = near.empty();
  for (const std::string& candidate : candidates) {
    if (candidate == near) continue;
    list += (first ? "" : ", ") + candidate;
    first = false;
  }
  return list;
}

std::string in_quotes(std::string_view text) {
  constexpr std::size_t longest_shown = 60;
  return quoted(text, longest_shown);
}

}  // namespace hil::config
