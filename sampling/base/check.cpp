#include "sampling/base/check.h"

#include <cstdio>
#include <cstdlib>

namespace hilbrush {
namespace {

void print_and_abort(const std::string& message) {
  std::fprintf(stderr, "%s\n", message.c_str());
  std::abort();
}

CheckHandler g_handler = print_and_abort;

}  // namespace

CheckHandler set_check_handler(CheckHandler handler) {
  const CheckHandler previous = g_handler;
  g_handler = handler;
  return previous;
}

void check_failed(const char* file, int line, const std::string& message) {
  g_handler(std::string(file) + ":" + std::to_string(line) + ": " + message);
  std::abort();
}

}  // namespace hilbrush
