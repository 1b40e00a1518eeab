#pragma once
// The names of a block, and what they stand for in its expressions.
//
// Threads: the one that compiles the block.

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/expression/program.hpp"

namespace hil::modules {

class BlockNames final : public expression::Scope {
 public:
  /// `noun`: what the names stand for, in error texts.
  explicit BlockNames(std::string noun) : noun_(std::move(noun)) {}

  /// A name that can not be read in an expression, is there already, or is that of a function of the language
  /// while it names a table, is a mistake. `what`: "input", "state".
  void declare(const std::string& what, const std::string& name, const config::Place& place,
               config::Diagnostics& diagnostics);
  /// The value that the name stands for, in this unit, from now on.
  void define(const std::string& name, std::uint32_t value, std::string unit,
              const std::map<std::string, double>& named_values = {}, bool accepts_any_name = false,
              units::ValueKind value_kind = units::ValueKind::as_unit);
  /// Its definition has a mistake, unless it is defined later: expressions with the name add no other one.
  void set_broken(const std::string& name) { broken_.insert(name); }
  void define_table(const std::string& name, const expression::Table& table) { tables_[name] = &table; }

  /// Null: not defined (yet).
  const expression::Variable* defined(std::string_view name) const;

  /// The name is used from then on.
  std::optional<expression::Variable> find(std::string_view name) const override;
  std::vector<std::string> names() const override;
  bool is_broken(std::string_view name) const override { return broken_.contains(name); }
  const expression::Table* find_table(std::string_view name) const override;
  bool is_used(std::string_view name) const { return used_.contains(name); }
  std::vector<std::string> table_names() const override;
  std::string noun() const override { return noun_; }

 private:
  struct Declared {
    std::string what;
    std::uint32_t line = 0;
  };
  const std::string noun_;
  std::map<std::string, Declared, std::less<>> declared_;
  std::set<std::string, std::less<>> broken_;
  mutable std::set<std::string, std::less<>> used_;
  std::map<std::string, expression::Variable, std::less<>> defined_;
  std::map<std::string, const expression::Table*, std::less<>> tables_;
  std::deque<std::map<std::string, double>> named_values_;  ///< at fixed places
};

}  // namespace hil::modules
