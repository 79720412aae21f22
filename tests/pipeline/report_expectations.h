#pragma once
#include <filesystem>
#include <string>

/// What must hold for every report of a run that painted, whatever the model.
namespace hilbrush::testing_pipeline {

/// Keys are all there and sane, counts add up, every hit is where planning wanted it, and the files it names
/// exist in `folder`.
void expect_sound_dry_run(const std::string& report_text, const std::filesystem::path& folder);

}  // namespace hilbrush::testing_pipeline
