#pragma once
#include <filesystem>
#include <string>

namespace hilbrush {

/// Makes `folder` and what is above it, where absent. @throws InputError naming the folder.
void make_output_folder(const std::filesystem::path& folder);

/// Replaces `file` in one step, so that it is whole or absent. @throws InputError naming the file.
void write_text_file(const std::filesystem::path& file, const std::string& text);

}  // namespace hilbrush
