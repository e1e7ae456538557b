#include "instances/io/modbus/images/image_table.hpp"

namespace plchost::modbus {

Result<ImageTable> ImageTable::open(const std::string& pool, const std::vector<ImageConfig>& images) {
  ImageTable table;
  for (const ImageConfig& image : images) {
    if (image.direction == ImageDirection::input) {
      PLCHOST_TRY_ASSIGN(table.inputs_[image.name], InputImage::open(pool, image.name, image.size));
    } else {
      PLCHOST_TRY_ASSIGN(table.outputs_[image.name], OutputImage::open(pool, image.name, image.size));
    }
  }
  return table;
}

InputImage* ImageTable::input(const std::string& name) const noexcept {
  const auto found = inputs_.find(name);
  return found == inputs_.end() ? nullptr : found->second.get();
}

OutputImage* ImageTable::output(const std::string& name) const noexcept {
  const auto found = outputs_.find(name);
  return found == outputs_.end() ? nullptr : found->second.get();
}

}  // namespace plchost::modbus
