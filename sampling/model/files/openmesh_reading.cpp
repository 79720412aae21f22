#include "sampling/model/files/openmesh_reading.h"

#include <OpenMesh/Core/System/omstream.hh>
#include <mutex>
#include <sstream>

#include "sampling/base/input_error.h"

namespace hilbrush {

void read_with_openmesh(std::string bytes, const std::string& name, bool stops_at_fault,
                        const std::function<bool(std::istream&)>& read) {
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  omerr().disable();
  omlog().disable();
  std::istringstream in(std::move(bytes));
  bool is_read = false;
  try {
    if (stops_at_fault) in.exceptions(std::ios::failbit | std::ios::badbit);
    is_read = read(in);
  } catch (const std::ios_base::failure&) {
    throw InputError(
        name,
        "the file ends early, holds something that is not a number, or more or fewer numbers than its header says");
  }
  if (!is_read) throw InputError(name, "the file cannot be understood");
}

}  // namespace hilbrush
