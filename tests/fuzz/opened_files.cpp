#include "tests/fuzz/opened_files.h"

#include <dlfcn.h>
#include <fcntl.h>

#include <cstdarg>
#include <cstdio>

namespace {

// Written from inside the C library's functions: plain storage, no allocation.
constexpr int kNameLimit = 256;
constexpr int kNameLength = 512;
bool is_watching = false;
int name_count = 0;
char opened_names[kNameLimit][kNameLength];

void note(const char* name) {
  if (!is_watching || !name || name_count >= kNameLimit) return;
  std::snprintf(opened_names[name_count], kNameLength, "%s", name);
  ++name_count;
}

template <class Function>
Function next_function(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace

// The linker prefers the program's own definitions to the C library's, for every library of the process.
extern "C" {
FILE* fopen(const char* name, const char* mode) {
  note(name);
  return next_function<FILE* (*)(const char*, const char*)>("fopen")(name, mode);
}
FILE* fopen64(const char* name, const char* mode) {
  note(name);
  return next_function<FILE* (*)(const char*, const char*)>("fopen64")(name, mode);
}
int open(const char* name, int flags, ...) {
  std::va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  note(name);
  return next_function<int (*)(const char*, int, mode_t)>("open")(name, flags, mode);
}
int open64(const char* name, int flags, ...) {
  std::va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  note(name);
  return next_function<int (*)(const char*, int, mode_t)>("open64")(name, flags, mode);
}
}

namespace hilbrush {

OpenedFiles::OpenedFiles() {
  name_count = 0;
  is_watching = true;
}

OpenedFiles::~OpenedFiles() {
  is_watching = false;
}

std::vector<std::string> OpenedFiles::names() const {
  return {opened_names, opened_names + name_count};
}

}  // namespace hilbrush
