// Programs of a version of the contract that is still to come: it has a topic, an operation and fields more
// (next_version.py). They are built from that contract and Cyclone DDS, and from nothing else of plchost.
//
//   next_version client DOMAIN HOST INSTANCE EVENT COUNT
//       asks for what is new, then for what today's hosts can do, too
//
//   next_version host DOMAIN
//       host "next" with instance "press": until SIGTERM

#include <span>
#include <string>
#include <utility>

#include "small_client.hpp"
#include "small_host.hpp"

namespace {

using namespace contract;

constexpr std::string_view kRecipe = "recipe";

class NextClient : public SmallClient {
 public:
  /// Requests and posts have the field that they have more.
  NextClient(std::uint32_t domain, std::string host) : SmallClient(domain, std::move(host)) {
    add_to_ext(kRecipe, "rye");
  }

  void list_recipes_of_instances() const {
    const auto reader =
        party().reader(plc_InstanceStatus_desc, "plc/v1/status/instance", {.depth = 0, .partition = "s.*"});
    take_status<plc_InstanceStatus>(reader, count_of(status(), "instance").value_or(0), "the instances",
                                    [](const plc_InstanceStatus& one) {
                                      const std::string recipe = value_in(one.ext, kRecipe);
                                      std::cout << "recipe of " << one.instance << ": "
                                                << (recipe.empty() ? "not known" : recipe) << '\n';
                                    });
  }

  /// A host of today counts no recipes, so that nothing is waited for.
  void list_recipes() const {
    const auto count = count_of(status(), kRecipe);
    if (!count) {
      std::cout << "recipes: no such topic\n";
      return;
    }
    const auto reader =
        party().reader(plc_RecipeStatus_desc, "plc/v1/status/recipe", {.depth = 0, .partition = "s.*"});
    take_status<plc_RecipeStatus>(reader, *count, "the recipes", [](const plc_RecipeStatus& one) {
      std::cout << "recipe " << one.recipe << " loaves " << one.loaves << '\n';
    });
  }

  void bake() {
    const plc_Reply reply = ask(plc_OPERATION_BAKE, "");
    std::cout << "bake " << reply.code << ' ' << std::string_view(reply.text).substr(0, 17) << '\n';
  }
};

class NextHost : public SmallHost {
 public:
  explicit NextHost(std::uint32_t domain) : SmallHost(domain, "next") {
    // In front of the count that a client of today looks for.
    status().counts[1] = status().counts[0];
    set(status().counts[0].topic, kRecipe);
    status().counts[0].samples = 1;
    set(recipe_.name, kRecipe);
    set(recipe_.value, "rye");
    set_ext(press().ext, std::span(&recipe_, 1));
    press().state = 77;  // a code that is new
    set(rye_.host, "next");
    set(rye_.recipe, "rye");
    rye_.epoch = 1;
  }

 private:
  void write_status() override {
    (void)dds_write(writer_, &rye_);
    SmallHost::write_status();
  }
  bool does(const plc_Request& request, plc_Reply& reply) override {
    if (request.operation == plc_OPERATION_READ_LOG) return write_log(request);
    if (request.operation != plc_OPERATION_BAKE) return false;
    set(reply.text, "baked " + value_in(request.ext, kRecipe));
    ++rye_.loaves;
    (void)dds_write(writer_, &rye_);
    return true;
  }

  // One line, whose record has the field more.
  bool write_log(const plc_Request& request) {
    plc_LogRecord line{};
    line.sequence_number = 1;
    line.level = 1;
    set(line.text, "the oven is hot");
    set_ext(line.ext, std::span(&recipe_, 1));
    plc_LogPage page{};
    page.related_identity = request.header.request_identity;
    set(page.host, "next");
    set(page.instance, "press");
    page.epoch = page.stream = page.next_after = 1;
    page.complete = true;
    page.records._buffer = &line;
    page.records._length = page.records._maximum = 1;
    const dds_entity_t pages =
        party().writer(plc_LogPage_desc, "plc/v1/log", {.depth = 4, .partition = reply_partition()});
    return dds_write(pages, &page) == DDS_RETCODE_OK;
  }

  dds_entity_t writer_ =
      party().writer(plc_RecipeStatus_desc, "plc/v1/status/recipe", {.partition = status_partition()});
  plc_KeyValue recipe_{};
  plc_RecipeStatus rye_{};
};

}  // namespace

int main(int argc, char** argv) {
  return run_program("next_version", [&] {
    const std::string verb = argc > 2 ? argv[1] : "";
    const std::uint32_t domain = argc > 2 ? static_cast<std::uint32_t>(std::stoul(argv[2])) : 0;
    if (verb == "host" && argc == 3) return NextHost(domain).run();
    if (verb != "client" || argc != 7) {
      throw std::invalid_argument("client DOMAIN HOST INSTANCE EVENT COUNT, or host DOMAIN");
    }
    NextClient client(domain, argv[3]);
    client.bake();
    client.list_recipes();
    client.list_recipes_of_instances();
    client.start(argv[4]);
    client.post(argv[4], argv[5], std::stoull(argv[6]));
  });
}
