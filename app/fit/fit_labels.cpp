#include "app/fit/fit_labels.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "app/schema/keys.hpp"

namespace sidewall::app {

std::vector<std::string> labels_of(const std::vector<std::string>& files) {
    if (files.size() == 1) return {""};
    std::vector<std::string> labels;
    for (const std::string& file : files) {
        labels.push_back(std::filesystem::path(file).stem().string());
        if (std::count(labels.begin(), labels.end(), labels.back()) > 1)
            throw RecipeError(
                fmt::format("{}: two recipes are called {}: their targets could not be told apart: "
                            "rename one",
                            file, labels.back()));
    }
    return labels;
}

std::vector<std::string> own_texts(const std::vector<std::string>& texts,
                                   const std::vector<std::string>& labels, const std::string& label) {
    std::vector<std::string> chosen;
    for (const std::string& text : texts) {
        const auto before = std::find_if(labels.begin(), labels.end(), [&](const std::string& any) {
            return !any.empty() && text.starts_with(any + ":");
        });
        if (before == labels.end())
            chosen.push_back(text);
        else if (*before == label)
            chosen.push_back(text.substr(label.size() + 1));
    }
    return chosen;
}

void require_labels(const char* option, const std::vector<std::string>& texts,
                    const std::vector<std::string>& labels) {
    for (const std::string& text : texts)
        for (const std::string& label : labels) {
            const std::size_t colon = text.find(':');
            const std::string before = text.substr(0, colon);
            if (label.empty() || std::find(labels.begin(), labels.end(), before) != labels.end()) break;
            throw RecipeError(
                fmt::format("{} {}: does not say of which recipe: write {}:{}{}", option, text, label,
                            colon == std::string::npos ? text : text.substr(colon + 1),
                            colon == std::string::npos ? "" : did_you_mean(": ", before, labels, "")));
        }
}

std::string with_label(const std::string& message, const std::string& label, const FitOptions& options) {
    if (label.empty()) return message;
    for (const auto& [option, texts] :
         {std::pair("--target-profile", &options.profiles), std::pair("--target", &options.targets),
          std::pair("--vary", &options.vary), std::pair("--set", &options.overrides)}) {
        const std::string start = std::string(option) + " ", missing = std::string(option) + ": missing";
        if (message.starts_with(missing))
            return fmt::format("{} for {}{}", missing, label, message.substr(missing.size()));
        if (!message.starts_with(start)) continue;
        const std::string rest = message.substr(start.size());
        const std::string name = rest.substr(0, rest.find_first_of("=@: "));
        for (const std::string& text : *texts)
            if (text.starts_with(fmt::format("{}:{}", label, name)))
                return fmt::format("{}{}:{}", start, label, rest);
    }
    return message.starts_with("--") ? label + ": " + message : message;
}

}  // namespace sidewall::app
