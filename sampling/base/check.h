#pragma once
#include <sstream>
#include <string>

/// Broken invariants. CHECK is always on; its handler is called with the message and must not return (the
/// daemon's turns the beam off first). What a file, a setting or a request can cause is an InputError
/// instead, see input_error.h.
namespace hilbrush {

using CheckHandler = void (*)(const std::string& message);

/// Replaces the handler (default: print to stderr and abort). Returns the previous one. Call before threads
/// start.
CheckHandler set_check_handler(CheckHandler handler);

[[noreturn]] void check_failed(const char* file, int line, const std::string& message);

namespace detail {
template <class A, class B>
std::string describe_comparison(const char* expression, const A& a, const B& b) {
  std::ostringstream out;
  out << expression << " (" << a << " against " << b << ")";
  return out.str();
}
}  // namespace detail
}  // namespace hilbrush

#define CHECK(condition) \
  ((condition) ? void() : ::hilbrush::check_failed(__FILE__, __LINE__, "broken invariant: " #condition))
#define CHECK_OP_(a, b, op)               \
  (((a)op(b)) ? void()                    \
              : ::hilbrush::check_failed( \
                    __FILE__, __LINE__,   \
                    ::hilbrush::detail::describe_comparison("broken invariant: " #a " " #op " " #b, a, b)))
#define CHECK_EQ(a, b) CHECK_OP_(a, b, ==)
#define CHECK_LE(a, b) CHECK_OP_(a, b, <=)
#define CHECK_LT(a, b) CHECK_OP_(a, b, <)
