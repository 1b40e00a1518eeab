#include "runtime/expression/definition_order.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "runtime/expression/relation.hpp"

namespace hil::expression {
namespace {

/// A depth-first search, without recursion, since a file may have 100,000 definitions in one chain.
class Search {
 public:
  Search(std::span<const Definition> definitions, config::Diagnostics& diagnostics)
      : definitions_(definitions), diagnostics_(diagnostics), marks_(definitions.size()) {
    for (std::size_t i = 0; i < definitions.size(); ++i)
      index_.emplace(definitions[i].name.text, i);
    reads_.reserve(definitions.size());
    for (const Definition& definition : definitions)
      reads_.push_back(definition.expression ? names_read(definition.expression->nodes())
                                             : std::vector<std::string>{});
  }

  std::vector<std::size_t> order() {
    for (std::size_t i = 0; i < definitions_.size(); ++i) {
      enter(i);
      while (!path_.empty())
        go_on();
    }
    return std::move(order_);
  }

 private:
  enum class Mark : std::uint8_t { unseen, open, done, circular };
  struct Step {
    std::size_t definition = 0;
    std::size_t next_name = 0;  ///< of those that it reads
  };

  void enter(std::size_t i) {
    if (!definitions_[i].expression) return;
    if (marks_[i] == Mark::open) report_circle(i);
    if (marks_[i] != Mark::unseen) return;
    marks_[i] = Mark::open;
    path_.push_back({.definition = i});
  }

  /// Visits what the last definition of the path reads next, or ends it.
  void go_on() {
    Step& step = path_.back();
    const std::vector<std::string>& names = reads_[step.definition];
    while (step.next_name < names.size()) {
      const auto read = index_.find(names[step.next_name++]);
      if (read == index_.end()) continue;
      enter(read->second);
      return;
    }
    if (marks_[step.definition] == Mark::open) {
      marks_[step.definition] = Mark::done;
      order_.push_back(step.definition);
    }
    path_.pop_back();
  }

  void report_circle(std::size_t i) {
    constexpr std::size_t max_shown = 8;
    std::string circle;
    std::size_t length = 0;
    for (auto at = std::ranges::find(path_, i, &Step::definition); at != path_.end(); ++at) {
      if (length++ < max_shown) circle += definitions_[at->definition].name.text + " needs ";
      marks_[at->definition] = Mark::circular;
    }
    if (length > max_shown) circle += "... needs ";
    diagnostics_.add(definitions_[i].name.place,
                     circle + definitions_[i].name.text + ": a value can not be computed from itself");
  }

  const std::span<const Definition> definitions_;
  config::Diagnostics& diagnostics_;
  std::map<std::string, std::size_t, std::less<>> index_;
  std::vector<std::vector<std::string>> reads_;  ///< by definition: the names in its expression
  std::vector<Mark> marks_;
  std::vector<Step> path_;
  std::vector<std::size_t> order_;
};

}  // namespace

std::vector<std::size_t> definition_order(std::span<const Definition> definitions,
                                          config::Diagnostics& diagnostics) {
  return Search(definitions, diagnostics).order();
}

}  // namespace hil::expression
