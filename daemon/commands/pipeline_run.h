#pragma once
#include <cstddef>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

/// Runs hilbrush-pipeline, which does all work on a mesh, as a child process. The child prints one JSON
/// object a line:
///   {"stage":"plan","fraction":0.4}   {"warning":"..."}   and last {"result":{...}} or
///   {"error":{"at":"cup.wrl:12","message":"..."}}
/// and ends with one of the exit codes 0 to 3. Other output goes to standard error, which is quoted if the
/// child fails.
namespace hilbrush {

struct PipelineRunListener {
  std::function<void(const std::string& stage, double fraction)> on_progress;
  std::function<void(const std::string& sentence)> on_warning;
};

/// The run failed; what() is a sentence for the operator, at() the file or key at fault, if there is one.
class PipelineFailure : public std::runtime_error {
 public:
  PipelineFailure(int exit_code, const std::string& sentence, std::string at = {},
                  std::string child_stderr = {})
      : std::runtime_error(sentence),
        exit_code_(exit_code),
        at_(std::move(at)),
        child_stderr_(std::move(child_stderr)) {}
  int exit_code() const { return exit_code_; }  ///< see exit_code.h
  const std::string& at() const { return at_; }
  const std::string& child_stderr() const { return child_stderr_; }  ///< the last kilobytes of it

 private:
  int exit_code_;
  std::string at_, child_stderr_;
};

/// $HILBRUSH_PIPELINE, or hilbrush-pipeline beside this program. @throws PipelineFailure if there is none.
std::string find_pipeline_program();

/// Runs `program` with `arguments` to its end and returns the text of its result. The child has a process
/// group of its own; Ctrl-C and SIGTERM end the whole group. @throws PipelineFailure, Interrupted
std::string run_pipeline_program(const std::string& program, const std::vector<std::string>& arguments,
                                 const PipelineRunListener& listener);

}  // namespace hilbrush
