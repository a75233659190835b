// SPDX-License-Identifier: LGPL-2.1-or-later
#include "command_line.h"

#include <CLI/CLI.hpp>
#include <cstdio>

namespace polyhull {

Option Option::required() {
  option_->required();
  return *this;
}

Option Option::shown() {
  option_->capture_default_str();
  return *this;
}

Option Option::expected(int count) {
  option_->expected(count)->allow_extra_args(false);
  return *this;
}

Option Option::separated_by(char delimiter) {
  option_->delimiter(delimiter);
  return *this;
}

Option Option::type_name(const std::string& name) {
  option_->type_name(name);
  return *this;
}

Option Option::range(int least, int most) {
  option_->check(CLI::Range(least, most));
  return *this;
}

Option Option::range(double least, double most) {
  option_->check(CLI::Range(least, most));
  return *this;
}

Option Option::not_negative() {
  option_->check(CLI::NonNegativeNumber);
  return *this;
}

Option Option::one_of(std::initializer_list<int> values) {
  option_->check(CLI::IsMember(values));
  return *this;
}

Option Option::one_of(std::initializer_list<const char*> values) {
  option_->check(CLI::IsMember(values));
  return *this;
}

Option Option::existing_file() {
  option_->check(CLI::ExistingFile);
  return *this;
}

Option Option::existing_folder() {
  option_->check(CLI::ExistingDirectory);
  return *this;
}

Option Option::needs(const Option& other) {
  option_->needs(other.option_);
  return *this;
}

Option Option::excludes(const Option& other) {
  option_->excludes(other.option_);
  return *this;
}

bool Option::given() const {
  return option_->count() > 0;
}

CommandLine::CommandLine(const std::string& name, const std::string& description)
    : app_(std::make_shared<CLI::App>(description, name)) {}

Option CommandLine::option(const std::string& names, Value value, const std::string& description) {
  return std::visit(
      [&](auto* variable) { return Option(app_->add_option(names, *variable, description)); },
      value);
}

Option CommandLine::flag(const std::string& names, bool* value, const std::string& description) {
  return Option(app_->add_flag(names, *value, description));
}

Option CommandLine::choice(const std::string& names, int value, const std::string& description,
                           const std::vector<std::pair<std::string, int>>& words,
                           const std::function<void(const int&)>& set) {
  // As numbers, for CLI11 would print enums of one byte as characters.
  CLI::Option* option = app_->add_option_function(names, set, description);
  option->type_name("ENUM")->transform(
      CLI::CheckedTransformer(words).description(CLI::detail::generate_map(words, true)));
  for (const auto& [word, meaning] : words)
    if (meaning == value) option->default_function([word = word] { return word; });
  return Option(option);
}

CommandLine CommandLine::subcommand(const std::string& name, const std::string& description) {
  app_->require_subcommand(1);
  return CommandLine(app_->get_subcommand_ptr(app_->add_subcommand(name, description)));
}

void CommandLine::footer(const std::string& text) {
  app_->footer(text);
}

std::optional<int> CommandLine::parse(int count, char** arguments) {
  try {
    app_->parse(count, arguments);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    return app_->exit(error);
  }
}

int CommandLine::run(int count, char** arguments, const std::function<int()>& program) {
  if (const std::optional<int> status = parse(count, arguments)) return *status;
  try {
    return program();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", app_->get_name().c_str(), error.what());
    return 1;
  }
}

bool CommandLine::given() const {
  return app_->parsed();
}

}  // namespace polyhull
