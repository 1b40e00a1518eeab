#include "runtime/run/fail_on.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

#include "runtime/config/parse.hpp"

namespace hil::run {
namespace {

constexpr std::array counts{"misses",        "overruns",     "skipped",     "aborted",       "over_budget",
                            "skipped_ticks", "lost_records", "hard_misses", "without_result"};

std::uint32_t index_of(const std::string& name) {
  return static_cast<std::uint32_t>(std::find(counts.begin(), counts.end(), name) - counts.begin());
}

bool is_word_letter(char letter) {
  return std::isalnum(static_cast<unsigned char>(letter)) != 0 || letter == '_' || letter == '.';
}

/// Adds a mistake for each word that is not a count, even when the condition has other mistakes.
void check_words(const config::Value& value, config::Diagnostics& diagnostics) {
  constexpr std::array joining{"and", "or", "not", "if", "then", "else", "true", "false"};
  const std::string& text = value.text();
  for (std::size_t begin = 0; begin < text.size(); ++begin) {
    if (!is_word_letter(text[begin])) continue;
    std::size_t end = begin;
    while (end < text.size() && is_word_letter(text[end]))
      ++end;
    const std::string word = text.substr(begin, end - begin);
    const bool is_number = std::isdigit(static_cast<unsigned char>(word.front())) != 0 || word.front() == '.';
    const bool joins = std::find(joining.begin(), joining.end(), word) != joining.end();
    if (!is_number && !joins && index_of(word) == counts.size()) {
      diagnostics.add(value.place_in_text(begin),
                      config::in_quotes(word) + " is not a count of the run" +
                          config::all_known(word, {counts.begin(), counts.end()}));
    }
    begin = end;
  }
}

/// The place in the user's text: the parsed text has a quotation mark before it.
config::Place without_quote(config::Place place) {
  if (place.column > 1) --place.column;
  return place;
}

class Counts final : public expression::Scope {
 public:
  std::optional<expression::Variable> find(std::string_view name) const override {
    const std::uint32_t index = index_of(std::string(name));
    if (index == counts.size()) return std::nullopt;
    return expression::Variable{.index = index};
  }
  std::vector<std::string> names() const override { return {counts.begin(), counts.end()}; }
  std::string noun() const override { return "count"; }
};

std::optional<FailOn> parse_quoted(const std::string& text, config::Diagnostics& diagnostics) {
  // A JSON string is a YAML string, and the YAML parser gives the text a place.
  const std::string quoted =
      nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  const auto value = config::parse_text("--fail-on", quoted, config::Schema::text(), diagnostics);
  if (!value) return std::nullopt;
  check_words(*value, diagnostics);
  if (!diagnostics.empty()) return std::nullopt;
  const auto condition = config::Expression::parse(*value, diagnostics);
  if (!condition) return std::nullopt;
  auto program = expression::Program::compile(*condition, Counts(), {.truth = true, .what = "--fail-on"}, {},
                                              diagnostics);
  if (!program) return std::nullopt;
  if (program->variables().empty())
    diagnostics.add(value->place(), "the condition reads no count of the run");
  return FailOn{.text = text, .condition = std::move(*program)};
}

}  // namespace

std::optional<FailOn> parse_fail_on(const std::string& text, config::Diagnostics& diagnostics) {
  config::Diagnostics quoted;
  auto condition = parse_quoted(text, quoted);
  for (const config::Mistake& mistake : quoted.mistakes())
    diagnostics.add(without_quote(mistake.place), mistake.message);
  return quoted.mistakes().empty() ? std::move(condition) : std::nullopt;
}

bool timing_broken(const FailOn& fail_on, const executive::RunResult& result,
                   const report::RunRecord& record) {
  std::array<double, counts.size()> values{};
  for (const executive::TaskResult& task : result.tasks) {
    values[0] += static_cast<double>(task.deadline_misses);
    values[1] += static_cast<double>(task.overruns);
    values[2] += static_cast<double>(task.skipped);
    values[3] += static_cast<double>(task.aborted);
    values[4] += static_cast<double>(task.over_budget);
  }
  values[5] = static_cast<double>(result.base.skipped_ticks);
  values[6] = static_cast<double>(result.lost_records);
  values[7] = static_cast<double>(record.transactions.hard_misses);
  for (const report::Task& task : record.tasks)
    values[8] += static_cast<double>(task.without_result);
  expression::Program condition = fail_on.condition;
  return condition.evaluate(values, 0.0) == 1.0;
}

}  // namespace hil::run
