#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "instances/io/modbus/config/modbus_config.hpp"
#include "instances/io/modbus/images/input_image.hpp"
#include "instances/io/modbus/images/memory_image.hpp"
#include "instances/io/modbus/images/output_image.hpp"
#include "shm/base/result.hpp"

namespace plchost::modbus {

/// All images of the configuration. It does not change after its set-up: any thread.
class ImageTable {
 public:
  [[nodiscard]] static Result<ImageTable> open(const std::string& pool,
                                               const std::vector<ImageConfig>& images);
  /// Null: there is no such image of that direction.
  [[nodiscard]] InputImage* input(const std::string& name) const noexcept;
  [[nodiscard]] OutputImage* output(const std::string& name) const noexcept;
  [[nodiscard]] MemoryImage* memory(const std::string& name) const noexcept;
  [[nodiscard]] const std::map<std::string, std::unique_ptr<InputImage>>& inputs() const noexcept {
    return inputs_;
  }

 private:
  std::map<std::string, std::unique_ptr<InputImage>> inputs_;
  std::map<std::string, std::unique_ptr<OutputImage>> outputs_;
  std::map<std::string, std::unique_ptr<MemoryImage>> memories_;
};

}  // namespace plchost::modbus
