#include "config/json_reader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace hilbrush {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// One of everything.
void read_sample(JsonObject& json) {
  json.object("axis", [](JsonObject& axis) { axis.quantity("max_deg", {-720, 720}); });
  json.number("share", {0, 1});
  json.integer("count", 1, 100);
  json.boolean("on");
  json.text("name", 8);
  json.choice("color", {"red", "green", "blue"});
  json.numbers("curve", 2, 3, {0, 1});
  json.objects("parts", 2, [](JsonObject& part) { part.quantity("radius_mm", {0, 10}); });
  json.optional_number("extra", {0, kInfinity});
}

const std::string kSample =
    R"({"axis":{"max_deg":90},"share":0.5,"count":7,"on":true,"name":"cup","color":"red","curve":[0,1],"parts":[{"radius_mm":2}]})";

/// kSample with the first `from` replaced.
std::string changed(const std::string& from, const std::string& to) {
  std::string text = kSample;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string error_of(const std::string& text, const std::string& origin = "f.json") {
  try {
    read_json_object(text, origin, read_sample);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(JsonReader, TheSampleIsAccepted) {
  EXPECT_EQ(error_of(kSample), "accepted");
}

TEST(JsonReader, EveryMistakeIsRefusedWithItsPathAndASentence) {
  struct Case {
    const char *from, *to, *error;
  };
  const Case cases[] = {
      {"90", "\"x\"", "f.json: $.axis.max_deg: expected a number from -720 to 720, found \"x\""},
      {"90", "721", "f.json: $.axis.max_deg: expected a number from -720 to 720, found 721"},
      {"90", "null", "f.json: $.axis.max_deg: expected a number from -720 to 720, found null"},
      {"90", "[90]", "f.json: $.axis.max_deg: expected a number from -720 to 720, found a list of 1"},
      {"max_deg", "max_rad",
       "f.json: $.axis.max_deg: missing: expected a number from -720 to 720, found the key \"max_rad\" "
       "instead"},
      {"max_deg", "max_dge",
       "f.json: $.axis.max_deg: missing: expected a number from -720 to 720, found the key \"max_dge\" "
       "instead"},
      {"{\"max_deg\":90}", "{}", "f.json: $.axis.max_deg: missing: expected a number from -720 to 720"},
      {"{\"max_deg\":90}", "3", "f.json: $.axis: expected an object, found 3"},
      {"0.5", "1.5", "f.json: $.share: expected a number from 0 to 1, found 1.5"},
      {"0.5", "true", "f.json: $.share: expected a number from 0 to 1, found true"},
      {"7", "7.5", "f.json: $.count: expected a whole number from 1 to 100, found 7.5"},
      {"7", "0", "f.json: $.count: expected a whole number from 1 to 100, found 0"},
      {"7", "-7", "f.json: $.count: expected a whole number from 1 to 100, found -7"},
      {"7", "101", "f.json: $.count: expected a whole number from 1 to 100, found 101"},
      {"7", "1e30", "f.json: $.count: expected a whole number from 1 to 100, found 1e+30"},
      {"true", "1", "f.json: $.on: expected true or false, found 1"},
      {"\"cup\"", "\"\"", "f.json: $.name: expected a text of 1 to 8 bytes, found 0"},
      {"\"cup\"", "\"123456789\"", "f.json: $.name: expected a text of 1 to 8 bytes, found 9"},
      {"\"cup\"", "\"a\\nb\"", "f.json: $.name: expected a text without control characters, found \"a\\nb\""},
      {"\"cup\"", "{}", "f.json: $.name: expected a text, found an object"},
      {"\"red\"", "\"rot\"", "f.json: $.color: expected \"red\", \"green\" or \"blue\", found \"rot\""},
      {"\"red\"", "0", "f.json: $.color: expected \"red\", \"green\" or \"blue\", found 0"},
      {"[0,1]", "[0]", "f.json: $.curve: expected a list of 2 to 3 numbers, found a list of 1"},
      {"[0,1]", "[0,1,1,1]", "f.json: $.curve: expected a list of 2 to 3 numbers, found a list of 4"},
      {"[0,1]", "[0,\"1\"]", "f.json: $.curve[1]: expected a number from 0 to 1, found \"1\""},
      {"[0,1]", "[-0.1,1]", "f.json: $.curve[0]: expected a number from 0 to 1, found -0.1"},
      {"[{\"radius_mm\":2}]", "[{\"radius_mm\":2},{\"radius_mm\":-2}]",
       "f.json: $.parts[1].radius_mm: expected a number from 0 to 10, found -2"},
      {"[{\"radius_mm\":2}]", "[1]", "f.json: $.parts[0]: expected an object, found 1"},
      {"[{\"radius_mm\":2}]", "[{},{},{}]",
       "f.json: $.parts: expected a list of at most 2 objects, found a list of 3"},
      {"\"on\":true", "\"on\":true,\"of\":1", "f.json: $.of: unknown key"},
      {"\"on\":true", "\"on\":true,\"extar\":1", "f.json: $.extar: unknown key; did you mean \"extra\"?"},
      {"\"on\":true", "\"on\":true,\"extra\":-1",
       "f.json: $.extra: expected a number of at least 0, found -1"},
      {"\"on\":true", "\"on\":true,\"a\\u001bb\":1", "f.json: $[\"a\\u001bb\"]: unknown key"},
      {"\"on\":true", "\"on\":true,\"on\":true", "f.json: $.on: this key appears twice"},
      {"{\"max_deg\":90}", "{\"max_deg\":90,\"max_deg\":90}",
       "f.json: $.axis.max_deg: this key appears twice"},
      {"2}", "2,\"radius_mm\":2}", "f.json: $.parts[].radius_mm: this key appears twice"},
      {"90", "1e999", "f.json: $: number overflow parsing '1e999'"},
  };
  for (const Case& c : cases) EXPECT_EQ(error_of(changed(c.from, c.to)), c.error);
}

TEST(JsonReader, AnOriginThatIsAPathIsContinued) {
  EXPECT_EQ(error_of(changed("0.5", "2"), "$.settings"),
            "$.settings.share: expected a number from 0 to 1, found 2");
  EXPECT_EQ(error_of("[]", "$.settings"), "$.settings: expected an object, found a list of 0");
}

TEST(JsonReader, OptionalKeysMayBeNullOrAbsentButNotWrong) {
  EXPECT_EQ(error_of(changed("\"on\":true", "\"on\":true,\"extra\":null")), "accepted");
  EXPECT_EQ(error_of(changed("\"on\":true", "\"on\":true,\"extra\":7")), "accepted");
}

TEST(JsonReader, SyntaxErrorsNameTheLineOfAFile) {
  EXPECT_EQ(error_of("{\n \"a\": 1,\n}").substr(0, 33), "f.json:3: not JSON at column 1: s");
  EXPECT_EQ(error_of("").substr(0, 32), "f.json:1: not JSON at column 1: ");
  EXPECT_EQ(error_of("{\"a\":1} x").substr(0, 33), "f.json:1: not JSON at column 9: s");
  EXPECT_EQ(error_of("{,}", "").substr(0, 37), "$: not JSON at line 1, column 2: synt");
  EXPECT_EQ(error_of("{\"a\": \"\xff\"}").substr(0, 10), "f.json:1: ");  // not UTF-8
  EXPECT_EQ(error_of("[]"), "f.json: $: expected an object, found a list of 0");
}

TEST(JsonReader, DepthAndSizeAreLimited) {
  const auto ignore = [](JsonObject&) {};
  const auto error = [&](const std::string& text, JsonLimits limits) -> std::string {
    try {
      read_json_object(text, "f", ignore, limits);
    } catch (const InputError& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_EQ(error("{\"a\":{\"b\":{}}}", {.depth = 2}), "f: $.a.b: nested more than 2 levels deep");
  EXPECT_EQ(error("{\"a\":{\"b\":{}}}", {.depth = 3}), "f: $.a: unknown key");
  EXPECT_EQ(error("{}        ", {.bytes = 4}), "f: $: longer than 4 bytes");
  // Deeper than any stack.
  EXPECT_NE(error(std::string(500'000, '['), {}).find("nested more than 16 levels"), std::string::npos);
  std::string objects;
  for (int i = 0; i < 50'000; ++i) objects += "{\"a\":";
  EXPECT_NE(error(objects, {}).find("nested more than 16 levels"), std::string::npos);
}

TEST(JsonReader, QuantitiesComeInSiUnits) {
  const auto read = [](const char* key, double value) {
    double result = 0;
    read_json_object("{\"" + std::string(key) + "\":" + std::to_string(value) + "}", "",
                     [&](JsonObject& json) {
                       result = json.quantity(key, {-kInfinity, kInfinity});
                     });
    return result;
  };
  EXPECT_DOUBLE_EQ(read("max_deg", 180), std::numbers::pi);
  EXPECT_DOUBLE_EQ(read("speed_deg_s", 90), std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(read("acceleration_deg_s2", 360), 2 * std::numbers::pi);
  EXPECT_EQ(read("radius_mm", 225), .225);
  EXPECT_EQ(read("speed_mm_s", 1100), 1.1);
  EXPECT_EQ(read("acceleration_mm_s2", 18000), 18.);
  EXPECT_EQ(read("pulse_ms", 5), .005);
  EXPECT_EQ(read("power_max_mw", 200), .2);
  EXPECT_EQ(read("dose_j_m2", 1000), 1000.);
  EXPECT_THROW(read("radius", 1), std::logic_error);  // reading code that forgot the unit
}

TEST(JsonReader, WholeNumbersKeepAllTheirDigits) {
  const auto read = [](const std::string& number) {
    std::uint64_t result = 0;
    read_json_object("{\"n\":" + number + "}", "",
                     [&](JsonObject& json) { result = json.integer("n", 0, UINT64_MAX); });
    return result;
  };
  EXPECT_EQ(read("18446744073709551615"), UINT64_MAX);
  EXPECT_EQ(read("9007199254740993"), 9007199254740993u);
  EXPECT_EQ(read("5e7"), 50'000'000u);
  EXPECT_THROW(read("1e19"), InputError);  // as a double it is not exact
}

TEST(JsonReader, NearestWordIsShyOfGuessing) {
  const std::vector<std::string> words{"dpi", "dots", "size_mm", "preferred_incidence_deg"};
  EXPECT_EQ(nearest_word("dip", words), std::nullopt);  // two changes in three letters is a guess
  EXPECT_EQ(nearest_word("dp", words), "dpi");
  EXPECT_EQ(nearest_word("sizemm", words), "size_mm");
  EXPECT_EQ(nearest_word("size_cm", words), "size_mm");
  EXPECT_EQ(nearest_word("prefered_incidence_deg", words), "preferred_incidence_deg");
  EXPECT_EQ(nearest_word("elephant", words), std::nullopt);
  EXPECT_EQ(nearest_word(std::string(100'000, 'd'), words), std::nullopt);
}

TEST(JsonReader, MutatedBytesAreAcceptedOrRefusedAndNothingElse) {
  constexpr unsigned kSeed = 11;
  std::mt19937 random(kSeed);
  int accepted = 0;
  int refused = 0;
  for (int round = 0; round < 20'000; ++round) {
    std::string text = kSample;
    for (unsigned change = 0; change <= random() % 4; ++change) {
      const std::size_t at = random() % text.size();
      if (random() % 3 == 0)
        text.erase(at, 1 + random() % 5);
      else if (random() % 2 == 0)
        text[at] = static_cast<char>(random());
      else
        text.insert(at, kSample.substr(random() % kSample.size(), random() % 20));
      if (text.empty()) text = "{";
    }
    try {
      read_json_object(text, "", read_sample);
      ++accepted;
    } catch (const InputError& error) {
      EXPECT_TRUE(error.at().starts_with("$"))
          << "seed " << kSeed << ", round " << round << ": " << error.what();
      ++refused;
    }
  }
  EXPECT_GT(accepted, 50);
  EXPECT_GT(refused, 10'000);
}

TEST(JsonReader, FilesAreReadWholeOrRefused) {
  EXPECT_THROW(read_text_file("/nonexistent/file.json", 10), InputError);
  EXPECT_THROW(read_text_file("/", 10), InputError);
  EXPECT_THROW(read_text_file("/dev/zero", 1000), InputError);  // endless
  EXPECT_EQ(read_text_file("/dev/null", 1000), "");
}

}  // namespace
}  // namespace hilbrush
