#pragma once
#include <stdexcept>
#include <string>
#include <utility>

namespace hilbrush {

/// A file, setting or request that cannot be used. `at()` says where: "cup.wrl:12" or a JSON path such as
/// "$.axes.j1.max_deg"; what() is "at: sentence". Caught once, where a job or
/// a request is handled.
class InputError : public std::runtime_error {
 public:
  InputError(std::string at, const std::string& sentence)
      : std::runtime_error(at.empty() ? sentence : at + ": " + sentence),
        at_(std::move(at)),
        sentence_(sentence) {}
  const std::string& at() const { return at_; }
  const std::string& sentence() const { return sentence_; }

 private:
  std::string at_;
  std::string sentence_;
};

}  // namespace hilbrush
