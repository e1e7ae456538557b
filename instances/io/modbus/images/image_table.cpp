#include "instances/io/modbus/images/image_table.hpp"

namespace plchost::modbus {

namespace {

template <class Image>
Image* found_in(const std::map<std::string, std::unique_ptr<Image>>& images,
                const std::string& name) noexcept {
  const auto found = images.find(name);
  return found == images.end() ? nullptr : found->second.get();
}

}  // namespace

Result<ImageTable> ImageTable::open(const std::string& pool, const std::vector<ImageConfig>& images) {
  ImageTable table;
  for (const ImageConfig& image : images) {
    switch (image.direction) {
      case ImageDirection::input: {
        PLCHOST_TRY_ASSIGN(table.inputs_[image.name], InputImage::open(pool, image.name, image.size));
        break;
      }
      case ImageDirection::output: {
        PLCHOST_TRY_ASSIGN(table.outputs_[image.name], OutputImage::open(pool, image.name, image.size));
        break;
      }
      case ImageDirection::memory:
        table.memories_[image.name] = std::make_unique<MemoryImage>(pool, image.name, image.size);
        break;
    }
  }
  return table;
}

InputImage* ImageTable::input(const std::string& name) const noexcept {
  return found_in(inputs_, name);
}

OutputImage* ImageTable::output(const std::string& name) const noexcept {
  return found_in(outputs_, name);
}

MemoryImage* ImageTable::memory(const std::string& name) const noexcept {
  return found_in(memories_, name);
}

}  // namespace plchost::modbus
