#pragma once
#include <string>
#include <vector>

#include "app/pictures/picture.hpp"

namespace sidewall::app {

/// A swatch of the key.
struct LegendEntry {
    std::string name;
    Colour colour;
};

/// The key to a picture's colours: a viridis bar of values, or swatches with names.
struct PictureKey {
    bool bar = false;
    std::string title;  ///< of the bar, with its unit
    double low = 0.0, high = 1.0;
    std::vector<LegendEntry> entries;  ///< where there is no bar

    bool empty() const { return !bar && entries.empty(); }
};

/// The column at a picture's right that holds the key; lengths in pixels.
struct KeyColumn {
    double width = 0.0;  ///< from here to the picture's right end; 0 without a key
    double left = 0.0;   ///< where the key begins
    double text = 0.0;   ///< height of a capital
};

/// Room for \p key: at most two fifths of the picture, the text as small as that takes.
KeyColumn key_column(const PictureKey& key, int width, int height);

/// Draws \p key into its column: the bar with round ticks and its title above, or the entries one below the
/// other.
void draw_key(Picture& picture, const PictureKey& key, const KeyColumn& column);

}  // namespace sidewall::app
