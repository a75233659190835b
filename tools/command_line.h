// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A program's command line: its options, the values that they set, and its --help.
#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

// Of CLI11, whose headers take seconds to compile: command_line.cpp alone includes them.
namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace polyhull {

/// An option that was added to a CommandLine, with which it lives. Its functions say more of it.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  Option required();
  /// --help shows the value that the variable has now, as the default.
  Option shown();
  /// Of a list: exactly \p count values at a time.
  Option expected(int count);
  /// Of a list: one argument may hold several, with \p delimiter between them.
  Option separated_by(char delimiter);
  /// --help shows \p name in the place of the value.
  Option type_name(const std::string& name);
  /// Only numbers from \p least to \p most.
  Option range(int least, int most);
  Option range(double least, double most);
  Option not_negative();
  /// Only one of \p values.
  Option one_of(std::initializer_list<int> values);
  Option one_of(std::initializer_list<const char*> values);
  Option existing_file();
  Option existing_folder();
  /// Given only together with \p other.
  Option needs(const Option& other);
  /// Not given together with \p other.
  Option excludes(const Option& other);

  /// Whether the parsed command line has it.
  bool given() const;

 private:
  CLI::Option* option_;
};

/// The command line of a program, or of one of its subcommands. Copies are the same command line.
class CommandLine {
 public:
  /// Variables that options set; they must live until the command line is parsed.
  using Value = std::variant<int*, unsigned*, std::int64_t*, std::uint64_t*, double*, std::string*,
                             std::vector<int>*, std::vector<double>*, std::vector<std::string>*>;

  /// \p name: as --help and messages show it.
  CommandLine(const std::string& name, const std::string& description);

  /// Adds an option: \p names as in "-o,--output", or without a hyphen for a positional argument.
  Option option(const std::string& names, Value value, const std::string& description = "");
  /// Adds a flag, which takes no value and sets \p value; "--x,!--no-x" has one that clears it.
  Option flag(const std::string& names, bool* value, const std::string& description = "");
  /// Adds an option that takes one of \p words and sets \p value to its meaning.
  template <typename Enum>
  Option choice(const std::string& names, Enum* value, const std::string& description,
                std::initializer_list<std::pair<const char*, Enum>> words) {
    std::vector<std::pair<std::string, int>> numbers;
    for (const auto& [word, meaning] : words) numbers.emplace_back(word, static_cast<int>(meaning));
    return choice(names, static_cast<int>(*value), description, numbers,
                  [value](int meaning) { *value = static_cast<Enum>(meaning); });
  }
  /// Adds a subcommand, of which the command line then has to name one.
  CommandLine subcommand(const std::string& name, const std::string& description);
  /// \p text follows the options in --help.
  void footer(const std::string& text);

  /// Sets the variables. Returns the program's exit status where it is to end at once: --help has
  /// been printed, or the reason why the command line cannot be used.
  [[nodiscard]] std::optional<int> parse(int count, char** arguments);
  /// Parses, then runs \p program. Returns the exit status: \p program's; 1 where it throws, with
  /// the exception's text on standard error after the program's name.
  [[nodiscard]] int run(int count, char** arguments, const std::function<int()>& program);
  /// Whether the parsed command line names this subcommand.
  bool given() const;

 private:
  explicit CommandLine(std::shared_ptr<CLI::App> app) : app_(std::move(app)) {}
  Option choice(const std::string& names, int value, const std::string& description,
                const std::vector<std::pair<std::string, int>>& words,
                const std::function<void(const int&)>& set);

  std::shared_ptr<CLI::App> app_;
};

}  // namespace polyhull
