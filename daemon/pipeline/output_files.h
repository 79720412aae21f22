#pragma once
#include <filesystem>
#include <string>

namespace hilbrush {

/// Makes `folder` and its parents where they do not exist. @throws InputError naming the folder.
void make_output_folder(const std::filesystem::path& folder);

/// Replaces `file` atomically: the file is complete or unchanged. @throws InputError naming the file.
void write_text_file(const std::filesystem::path& file, const std::string& text);

}  // namespace hilbrush
