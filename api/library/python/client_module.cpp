// The client library for Python: module plchost_client. Names are those of plchost_client.hpp; times are
// floats in seconds, wall-clock times are datetime. Calls let other threads of Python run; callbacks come on
// a thread of the library.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "api/library/python/types.hpp"

namespace plchost::python {

namespace {

using Progress = std::optional<py::function>;
Client::Progress told_progress(const Progress& progress) {
  if (!progress) return {};
  return [told = guarded<unsigned long long>(*progress)](unsigned long long bytes) { told(bytes); };
}

template <class Item>
Client::Watch begin(Client& client,
                    Client::Watch (Client::*watch)(const std::string&, std::function<void(const Item&)>),
                    const std::string& host, py::function callback) {
  return (client.*watch)(host, guarded<Item>(std::move(callback)));
}

/// 0, which is refused with a text, if it is none of the allowed ones.
std::chrono::milliseconds milliseconds_of(double seconds) {
  constexpr double kPerSecond = 1000;
  constexpr double kMost = 1e9;
  const bool good = seconds > 0 && seconds < kMost;
  return std::chrono::milliseconds(good ? static_cast<std::int64_t>(std::lround(seconds * kPerSecond)) : 0);
}

Client::Options options_of(unsigned domain, std::vector<std::string> interfaces,
                           std::vector<std::string> peers, std::string identity, double timeout,
                           std::string host) {
  return {.domain = domain,
          .interfaces = std::move(interfaces),
          .peers = std::move(peers),
          .identity = std::move(identity),
          .timeout = milliseconds_of(timeout),
          .host = std::move(host)};
}

using ClientClass = py::class_<Client, Holder<Client>>;

void define_calls(ClientClass& client) {
  client.def("close", &Client::close, NoGil())
      .def("__enter__", [](Client& self) -> Client& { return self; })
      .def("__exit__",
           [](Client& self, const py::args&) {
             const py::gil_scoped_release release;
             self.close();
           })
      .def("hosts", &Client::hosts, NoGil())
      .def("instances", &Client::instances, py::arg("host") = "", NoGil())
      .def("tasks", &Client::tasks, py::arg("host") = "", NoGil())
      .def("events", &Client::events, py::arg("host") = "", NoGil())
      .def("applications", &Client::applications, py::arg("host") = "", NoGil())
      .def("exceptions", &Client::exceptions, py::arg("host") = "", NoGil())
      .def("losses", &Client::losses, py::arg("host") = "", NoGil())
      .def("writers", &Client::writers, py::arg("host") = "", NoGil())
      .def("objects", &Client::objects, py::arg("host") = "", py::arg("pattern") = "",
           "The objects of the pool whose names match: '*' any characters, '?' one.", NoGil())
      .def("nodes", &Client::nodes, py::arg("host") = "", py::arg("base") = "",
           "The nodes that send each other blocks.", NoGil())
      .def("routes", &Client::routes, py::arg("host") = "", py::arg("base") = "",
           "How blocks go from one node to another, or to other hosts.", NoGil())
      .def("check_host", &Client::check_host, py::arg("host") = "",
           "Has the host looked at anew. Returns the result of each check.", NoGil())
      .def("read_clock", &Client::read_clock, py::arg("host") = "", NoGil())
      .def("statistics", &Client::statistics, py::arg("host"), py::arg("instance"), py::arg("task"), NoGil())
      .def("logs",
           py::overload_cast<const std::string&, const std::string&, unsigned long long>(&Client::logs),
           py::arg("host"), py::arg("instance"), py::arg("newest") = ~0ULL,
           "The lines of an instance, oldest first: the newest lines of those that the host keeps.", NoGil())
      .def("logs",
           py::overload_cast<const std::string&, const std::string&, const Client::LogLine&>(&Client::logs),
           py::arg("host"), py::arg("instance"), py::arg("after"),
           "The lines after one that logs() has returned before, to read on.", NoGil())
      .def("post",
           py::overload_cast<const std::string&, const std::string&, unsigned long long>(&Client::post),
           py::arg("host"), py::arg("event"), py::arg("count") = 1, NoGil())
      .def(
          "post_and_tell",
          [](Client& self, const std::string& host, const std::string& event, py::function done) {
            self.post(host, event, guarded<Client::Outcome>(std::move(done)));
          },
          py::arg("host"), py::arg("event"), py::arg("done"),
          "Returns at once; done(outcome) is called once.")
      .def("post_all", &Client::post_all, py::arg("host"), py::arg("events"), NoGil())
      .def("post_and_wait", &Client::post_and_wait, py::arg("host"), py::arg("event"), NoGil())
      .def("reset", &Client::reset, py::arg("host"), py::arg("instance"), py::arg("cold") = false, NoGil())
      .def("register_event", &Client::register_event, py::arg("host"), py::arg("event"), NoGil())
      .def("unregister_event", &Client::unregister_event, py::arg("host"), py::arg("event"), NoGil())
      .def("reload", &Client::reload, py::arg("host") = "",
           "Has the host read its configuration file again. Returns a line for each change; a faulty file "
           "changes nothing and raises ClientError with a line for each error.",
           NoGil());
}

/// Refused with a text if it is none of the allowed ones. 0 is allowed.
std::chrono::milliseconds duration_of(double seconds) {
  const auto duration = milliseconds_of(seconds);
  const bool is_none = seconds == 0;
  return duration.count() > 0 || is_none ? duration : std::chrono::milliseconds(-1);
}

unsigned long long record_variables(Client& self, const std::string& host, const std::string& instance,
                                    const std::vector<std::string>& patterns, double interval,
                                    double duration, unsigned long long count, const std::string& file,
                                    const std::optional<py::function>& sink) {
  if (sink && !file.empty()) throw ClientError(ClientError::invalid_argument, "name a file or a sink");
  const auto looks_for_signals = [] {  // Ctrl-C: neither a file nor each sink runs a line of Python
    const py::gil_scoped_acquire gil;
    if (::PyErr_CheckSignals() != 0) throw py::error_already_set();
    return true;
  };
  const Client::RecordOptions options{milliseconds_of(interval), duration_of(duration), count,
                                      looks_for_signals};
  const auto take = [&sink](const std::string& lines) {
    const py::gil_scoped_acquire gil;
    return !(*sink)(ToPython()(lines)).is(py::bool_(false));
  };
  const py::gil_scoped_release release;
  return sink ? self.record_variables(host, instance, patterns, options, Client::RecordSink(take))
              : self.record_variables(host, instance, patterns, options, file);
}

void define_variables(ClientClass& client) {
  client
      .def("variables", &Client::variables, py::arg("host"), py::arg("instance"),
           py::arg("patterns") = std::vector<std::string>(), NoGil())
      .def("sample", &Client::sample, py::arg("host"), py::arg("instance"), py::arg("patterns"), NoGil())
      .def("forces", &Client::forces, py::arg("host") = "", py::arg("instance") = "",
           "The variables that are forced, of an instance or of all of a host.", NoGil())
      .def("write_variable", &Client::write_variable, py::arg("host"), py::arg("instance"), py::arg("name"),
           py::arg("value"),
           "Writes a variable once, between two cycles. value: a text, as Structured Text writes it.",
           NoGil())
      .def("force_variable", &Client::force_variable, py::arg("host"), py::arg("instance"), py::arg("name"),
           py::arg("value"), "The variable has this value at the begin and the end of each cycle.", NoGil())
      .def("unforce_variable", &Client::unforce_variable, py::arg("host"), py::arg("instance"),
           py::arg("name"), "The variable keeps the value that it has. '*': all that are forced.", NoGil())
      .def("unforce_all", &Client::unforce_all, py::arg("host"), py::arg("instance"),
           "All forced variables of the instance keep the values that they have.", NoGil())
      .def(
          "watch_variables",
          [](Client& self, const std::string& host, const std::string& instance,
             const std::vector<std::string>& patterns, double interval, py::function callback) {
            auto told = guarded<Client::Sampled>(std::move(callback));
            const py::gil_scoped_release release;
            return self.watch_variables(host, instance, patterns, milliseconds_of(interval), std::move(told));
          },
          py::arg("host"), py::arg("instance"), py::arg("patterns"), py::arg("interval"), py::arg("callback"),
          "Samples the variables each interval (seconds, 0.01 to 3600) and calls back with each Sampled.")
      .def("record_variables", &record_variables, py::arg("host"), py::arg("instance"), py::arg("patterns"),
           py::arg("interval") = 0.1, py::arg("duration") = 0.0, py::arg("count") = 0, py::arg("file") = "",
           py::arg("sink") = py::none(),
           "Writes samples as CSV into a file, or gives the lines of each to sink(lines), until that returns "
           "False. Returns their number after the duration (seconds) or the count.");
}

/// A method for a command of the table.
void define_command(ClientClass& client, const std::string& method, const Client::Operation& operation) {
  const std::string& name = operation.name;
  const char* const argument = operation.argument.c_str();
  if (!operation.names_instance) {
    client.def(
        method.c_str(), [name](Client& self, const std::string& host) { return self.command(name, host); },
        py::arg("host") = "", operation.help.c_str(), NoGil());
  } else if (operation.loads && operation.argument.empty()) {
    client.def(
        method.c_str(),
        [name](Client& self, const std::string& host, const std::string& instance, bool boot, bool online) {
          return self.command(name, host, instance, {}, LoadOptions{boot, online});
        },
        py::arg("host"), py::arg("instance"), py::arg("boot") = false, py::arg("online") = false,
        operation.help.c_str(), NoGil());
  } else if (operation.loads) {
    client.def(
        method.c_str(),
        [name](Client& self, const std::string& host, const std::string& instance, const std::string& given,
               bool boot,
               bool online) { return self.command(name, host, instance, given, LoadOptions{boot, online}); },
        py::arg("host"), py::arg("instance"), py::arg(argument), py::arg("boot") = false,
        py::arg("online") = false, operation.help.c_str(), NoGil());
  } else if (operation.argument.empty()) {
    client.def(
        method.c_str(),
        [name](Client& self, const std::string& host, const std::string& instance) {
          return self.command(name, host, instance);
        },
        py::arg("host"), py::arg("instance"), operation.help.c_str(), NoGil());
  } else {
    auto run = [name](Client& self, const std::string& host, const std::string& instance,
                      const std::string& given) { return self.command(name, host, instance, given); };
    const auto define = [&](const auto& last) {
      client.def(method.c_str(), run, py::arg("host"), py::arg("instance"), last, operation.help.c_str(),
                 NoGil());
    };
    if (operation.may_be_left_out) {
      define(py::arg(argument) = "");
    } else {
      define(py::arg(argument));
    }
  }
}

/// An application that is sent, and commands that have no function of their own above, as "reset_statistics":
/// all of the table.
void define_commands(ClientClass& client) {
  client
      .def(
          "download_application",
          [](Client& self, const std::string& host, const std::string& instance, const std::string& file,
             bool boot, bool online, const Progress& progress) {
            const auto told = told_progress(progress);
            const py::gil_scoped_release release;
            return self.download_application(host, instance, file, LoadOptions{boot, online}, told);
          },
          py::arg("host"), py::arg("instance"), py::arg("file"), py::arg("boot") = false,
          py::arg("online") = false, py::arg("progress") = py::none(),
          "Sends a file of this machine to the instance, which loads it. progress(bytes): so many have "
          "arrived.")
      .def(
          "download_and_tell",
          [](Client& self, const std::string& host, const std::string& instance, const std::string& file,
             py::function done, bool boot, bool online, const Progress& progress) {
            self.download_application(host, instance, file, LoadOptions{boot, online},
                                      told_progress(progress), guarded<Client::Outcome>(std::move(done)));
          },
          py::arg("host"), py::arg("instance"), py::arg("file"), py::arg("done"), py::arg("boot") = false,
          py::arg("online") = false, py::arg("progress") = py::none(),
          "Returns at once; done(outcome) is called once.");
  client.def_static("topics", &Client::topics)
      .def(
          "status",
          [](Client& self, const std::string& topic, const std::string& host) {
            std::vector<Client::Record> records;
            {
              const py::gil_scoped_release release;
              records = self.status(topic, host);
            }
            py::list all;
            for (const Client::Record& record : records) all.append(dict_of(record));
            return all;
          },
          py::arg("topic"), py::arg("host") = "",
          "All samples of a status topic: a dict each, with the names of the contract.");
  client.def_static("operations", [] {
    std::vector<std::string> names;
    for (const auto& operation : Client::operations()) names.push_back(operation.name);
    return names;
  });
  client.def(
      "command",
      [](Client& self, const std::string& operation, const std::string& host, const std::string& instance,
         const std::string& argument, bool boot, bool online) {
        return self.command(operation, host, instance, argument, LoadOptions{boot, online});
      },
      py::arg("operation"), py::arg("host"), py::arg("instance") = "", py::arg("argument") = "",
      py::arg("boot") = false, py::arg("online") = false, NoGil());
  client.def(
      "command_and_tell",
      [](Client& self, const std::string& operation, const std::string& host, const std::string& instance,
         const std::string& argument, py::function done, bool boot, bool online) {
        self.command(operation, host, instance, argument, guarded<Client::Outcome>(std::move(done)),
                     LoadOptions{boot, online});
      },
      py::arg("operation"), py::arg("host"), py::arg("instance"), py::arg("argument"), py::arg("done"),
      py::arg("boot") = false, py::arg("online") = false, "Returns at once; done(outcome) is called once.");
  for (const Client::Operation& operation : Client::operations()) {
    std::string name = operation.name;
    std::ranges::replace(name, ' ', '_');
    if (!py::hasattr(client, name.c_str())) define_command(client, name, operation);
  }
}

void define_watches(ClientClass& client) {
  client
      .def("watch_hosts",
           [](Client& self, py::function callback) {
             return self.watch_hosts(guarded<Client::Host>(std::move(callback)));
           })
      .def("watch_instances",
           [](Client& self, const std::string& host, py::function callback) {
             return begin(self, &Client::watch_instances, host, std::move(callback));
           })
      .def("watch_tasks",
           [](Client& self, const std::string& host, py::function callback) {
             return begin(self, &Client::watch_tasks, host, std::move(callback));
           })
      .def("watch_events",
           [](Client& self, const std::string& host, py::function callback) {
             return begin(self, &Client::watch_events, host, std::move(callback));
           })
      .def("watch_applications",
           [](Client& self, const std::string& host, py::function callback) {
             return begin(self, &Client::watch_applications, host, std::move(callback));
           })
      .def("watch_exceptions",
           [](Client& self, const std::string& host, py::function callback) {
             return begin(self, &Client::watch_exceptions, host, std::move(callback));
           })
      .def("watch_transitions",
           [](Client& self, const std::string& host, py::function callback) {
             return begin(self, &Client::watch_transitions, host, std::move(callback));
           })
      .def(
          "watch_status",
          [](Client& self, const std::string& topic, const std::string& host, py::function callback) {
            return self.watch_status(topic, host, guarded<Client::Record>(std::move(callback)));
          },
          py::arg("topic"), py::arg("host"), py::arg("callback"),
          "As the others, for any status topic: a dict each, with `removed` beside the names of the "
          "contract.");
}

ClientClass define_client(py::module_& module) {
  ClientClass client(
      module, "Client",
      "One connection to all hosts of a DDS domain, or to one: host. timeout: seconds, of each call.");
  client.def(py::init([](unsigned domain, std::vector<std::string> interfaces, std::vector<std::string> peers,
                         std::string identity, double timeout, std::string host) {
               Holder<Client> made(new Client(options_of(domain, std::move(interfaces), std::move(peers),
                                                         std::move(identity), timeout, std::move(host))));
               clients().add(made.get());
               return made;
             }),
             py::arg("domain") = 0U, py::arg("interfaces") = std::vector<std::string>{"lo"},
             py::arg("peers") = std::vector<std::string>{}, py::arg("identity") = "",
             py::arg("timeout") = 3.0, py::arg("host") = "");
  return client;
}

void define_module(py::module_& module) {
  define_types(module);
  ClientClass client = define_client(module);
  define_calls(client);
  define_variables(client);
  define_commands(client);
  define_watches(client);
  py::module_::import("atexit").attr("register")(py::cpp_function([] { clients().close(); }, NoGil()));
}

}  // namespace

}  // namespace plchost::python

PYBIND11_MODULE(plchost_client, module) {
  module.doc() =
      "Sees and commands PLC hosts from anywhere over DDS. Import it before any other module that loads "
      "libddsc, as cyclonedds does: else waits follow the clock of the wall.";
  plchost::python::define_module(module);
}
