#include "sampling/model/model_images.h"

#include <utility>

namespace hilbrush {
namespace {

constexpr std::size_t kMaxSearches = 20'000;  ///< for files of one model; each may try sixteen spellings

}  // namespace

Result<std::filesystem::path> ModelImages::find(const std::filesystem::path& base, const std::string& url) {
  if (search_count_ >= kMaxSearches)
    return Failure{"the model names more than " + std::to_string(kMaxSearches) + " files"};
  ++search_count_;
  return folder_.find(base, url);
}

Result<int> ModelImages::open(const std::filesystem::path& base, const std::string& url) {
  const auto file = find(base, url);
  if (!file) return Failure{file.reason()};
  const auto [found, is_new] = images_.try_emplace(file->string(), Failure{});
  if (!is_new) return found->second;
  auto image = read_image_(*file, pixels_left_);
  if (!image) return found->second = Failure{image.reason()};
  image->name = folder_.name(*file);
  folder_.note(*file);
  return found->second = add(std::move(*image));
}

int ModelImages::add(Texture texture) {
  pixels_left_ -= texture.luminance.size();
  return builder_.add_texture(std::move(texture));
}

}  // namespace hilbrush
