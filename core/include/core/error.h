// Errors that the user can mend. Everything else that is thrown is a bug of ours.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace plumbline::core {

// Input that breaks a rule; what() is one line: file:line: key: the rule.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// In a configuration (YAML or --set).
class ConfigError : public InputError {
 public:
  using InputError::InputError;
};

// In a data file (poses, datasets).
class DataError : public InputError {
 public:
  using InputError::InputError;
};

// A rule that joins several keys, for those who know where the key was written.
struct RuleViolation {
  std::string key;
  std::string rule;
};

// The same where it only shows later, when a scenario's parts meet; what() is "key: rule".
class RuleError : public ConfigError {
 public:
  explicit RuleError(RuleViolation v) : ConfigError(v.key + ": " + v.rule), violation(std::move(v)) {}

  RuleViolation violation;  // the full key
};

}  // namespace plumbline::core
