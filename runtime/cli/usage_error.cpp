#include "runtime/cli/usage_error.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <hil/diagnostics.hpp>

#include "runtime/config/text_lists.hpp"

namespace hil::cli {
namespace {

/// The program, then the subcommands that the command line names, outermost first.
std::vector<const CLI::App*> named_commands(const CLI::App& app) {
  std::vector<const CLI::App*> commands{&app};
  while (!commands.back()->get_subcommands().empty())
    commands.push_back(commands.back()->get_subcommands().front());
  return commands;
}

std::string words_of(const std::vector<const CLI::App*>& commands) {
  std::string words = "hil";
  for (std::size_t i = 1; i < commands.size(); ++i)
    words += " " + commands[i]->get_name();
  return words;
}

std::vector<std::string> names_of_subcommands(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return names;
}

/// The options of the innermost command, then those of the commands that it passes unknown options to.
std::vector<std::string> names_of_options(const std::vector<const CLI::App*>& commands) {
  std::vector<std::string> names;
  for (std::size_t i = commands.size(); i-- > 0;) {
    for (const CLI::Option* option : commands[i]->get_options()) {
      for (const std::string& name : option->get_lnames())
        if (std::find(names.begin(), names.end(), "--" + name) == names.end()) names.push_back("--" + name);
    }
    if (!commands[i]->get_fallthrough()) break;
  }
  return names;
}

std::string name_of(const CLI::Option& option) {
  return option.get_lnames().empty() ? option.get_name() : "--" + option.get_lnames().front();
}

/// "'a', 'b' and 'c'"
std::string quoted_list(std::vector<std::string> values) {
  for (std::string& value : values)
    value = config::in_quotes(value);
  return config::text_list(values);
}

/// The error text for an option with more values than it takes; empty: there is none.
std::string repeated_option(const std::vector<const CLI::App*>& commands) {
  for (const CLI::App* command : commands) {
    for (const CLI::Option* option : command->get_options()) {
      const auto most = static_cast<std::size_t>(std::max(option->get_items_expected_max(), 0));
      const std::vector<std::string>& values = option->results();
      if (option->get_multi_option_policy() != CLI::MultiOptionPolicy::Throw || most == 0 ||
          values.size() <= most)
        continue;
      if (most == 1) {
        return name_of(*option) + " is given " +
               (values.size() == 2 ? "twice" : std::to_string(values.size()) + " times") + ": " +
               quoted_list(values) + "; give it once";
      }
      return name_of(*option) + " takes " + std::to_string(most) + " values, and " +
             std::to_string(values.size()) + " are given: " + quoted_list(values) + "; give it once";
    }
  }
  return {};
}

/// The error text for an unknown word; empty: every word is known.
std::string unknown_word(const std::vector<const CLI::App*>& commands) {
  std::vector<std::string> words = commands.front()->remaining(true);
  std::erase(words, "--");
  if (words.empty()) return {};
  const auto is_option = [](const std::string& word) { return word.size() > 1 && word.front() == '-'; };
  const std::vector<std::string> subcommands = names_of_subcommands(*commands.back());
  if (!subcommands.empty() && !is_option(words.front())) {
    return config::in_quotes(words.front()) + " is not a command of " + words_of(commands) +
           config::all_known(words.front(), subcommands);
  }
  // A word behind an unknown option is usually its value.
  const auto option = std::find_if(words.begin(), words.end(), is_option);
  if (option == words.end()) {
    return config::in_quotes(words.front()) + " is one argument too many; " + words_of(commands) +
           " --help lists the arguments";
  }
  const std::string name = option->substr(0, option->find('='));
  return "there is no option " + config::in_quotes(name) +
         config::all_known(name, names_of_options(commands));
}

/// The error text for a missing subcommand; empty: none is missing.
std::string missing_subcommand(const std::vector<const CLI::App*>& commands) {
  const std::vector<std::string> known = names_of_subcommands(*commands.back());
  if (known.empty() || commands.back()->get_require_subcommand_min() == 0) return {};
  std::string list;
  for (const std::string& name : known)
    list += (list.empty() ? "" : ", ") + name;
  return "a command is missing; known here: " + list;
}

}  // namespace

std::string usage_error(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<const CLI::App*> commands = named_commands(app);
  std::string sentence = repeated_option(commands);
  if (sentence.empty()) sentence = unknown_word(commands);
  if (sentence.empty()) sentence = missing_subcommand(commands);
  if (sentence.empty()) sentence = error.what();
  return words_of(commands) + ": " + sentence;
}

}  // namespace hil::cli
