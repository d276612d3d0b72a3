//! Every kind of finding: its stable name, severity, title and explanation.

use crate::diagnostics::{Code, Severity};

/// One row of the table.
pub(crate) struct Entry {
    pub(crate) number: u16,
    pub(crate) name: &'static str,
    pub(crate) severity: Severity,
    pub(crate) title: &'static str,
    pub(crate) explanation: &'static str,
}

macro_rules! codes {
    ($($constant:ident = $number:literal $name:literal $severity:ident $title:literal $explanation:literal)*) => {
        $(pub(crate) const $constant: Code = Code($number);)*
        pub(crate) const CODES: &[Entry] = &[$(Entry {
            number: $number,
            name: $name,
            severity: Severity::$severity,
            title: $title,
            explanation: $explanation,
        }),*];
    };
}

codes! {
    BAD_XML = 101 "S0101" Error "not well-formed XML"
        "The file is no well-formed XML: a tag is not closed, an entity is not declared, a character is not allowed. \
         Nothing is drawn. Opening and saving the file in an editor for SVG usually repairs it."
    NO_SVG = 102 "S0102" Error "no svg element"
        "The root element of the file is not `svg`. Nothing is drawn."
    TOO_COMPLEX = 103 "S0103" Error "limit exceeded"
        "The file multiplies itself beyond what any drawing needs: entities that expand to hundreds of megabytes, \
         elements nested hundreds deep, references that draw millions of elements, or selectors that match without \
         end. What was read before the limit is drawn."
    UNDECLARED_PREFIX = 104 "S0104" Warning "undeclared namespace prefix"
        "A name has a prefix, such as `xlink:` or `inkscape:`, that the file does not declare. It is read with the \
         usual meaning. Add the `xmlns:` declaration to the `svg` element."
    ENCODING = 105 "S0105" Warning "encoding assumed"
        "The text is not valid in the encoding that the file declares, or declares one that is not supported. It is \
         read as ISO 8859-1; letters outside ASCII may come out wrong."
    DAMAGED_GZIP = 106 "S0106" Error "damaged compression"
        "The gzip data of an `.svgz` file are damaged or cut short. Nothing is drawn."
    BAD_VALUE = 110 "S0110" Warning "value not understood"
        "An attribute or property has a value that is not allowed or not supported. The element is drawn as if it were \
         not given."
    BAD_PATH = 111 "S0111" Warning "error in path data"
        "The data of a path, polyline or polygon have an error. What stands before the error is drawn, as the \
         standard asks for."
    UNKNOWN_ELEMENT = 112 "S0112" Warning "unknown element"
        "An element in the SVG namespace whose name is not known. It is not drawn, nor is its content."
    CSS_SKIPPED = 113 "S0113" Warning "style rule skipped"
        "A rule of a style sheet is not supported: `@import`, `@supports`, media queries for the size of a window, \
         selectors that are malformed, or a language other than CSS. The rule has no effect."
    BAD_REFERENCE = 114 "S0114" Warning "reference to nothing"
        "A reference names an element that is not in the file, or lies in another file. Other files are not read."
    RECURSION = 115 "S0115" Warning "element refers to itself"
        "An element contains a reference to itself, by itself or through others. The reference is not followed."
    SIZE_ASSUMED = 120 "S0120" Note "size assumed"
        "The `svg` element lacks width or height (or gives them in percent). The size of the viewBox is taken, in \
         pixels; without a viewBox, the extent of the ink."
    DPI = 121 "S0121" Note "pixels per inch"
        "Pixels and numbers without unit are 1/96 inch, as CSS defines them. Illustrator counts 72 of them to the inch, \
         and Inkscape before version 0.92 counted 90. Sizes without unit in files of Illustrator are taken at 72 per \
         inch; everything else at 96, as today's Inkscape does. The option for pixels per inch overrides this."
    FILL_NOT_DRAWN = 201 "S0201" Warning "fill not drawn"
        "A shape is filled and has no stroke. A pen draws lines, so it leaves no ink. Hatch fills with the hatch \
         option, or give the shape a stroke."
    FILL_OF_STROKE = 202 "S0202" Note "only the stroke is drawn"
        "A shape has a stroke and a fill. The stroke is drawn, the fill is not. Hatch fills with the hatch option."
    IMAGE = 203 "S0203" Warning "image not drawn"
        "A picture made of pixels, or a linked file. A pen cannot draw it; trace it to paths in an editor."
    MASK = 204 "S0204" Warning "mask not applied"
        "Masks change opacity, which a pen does not have. The masked element is drawn whole. Use a clip path where the \
         mask has sharp edges."
    FILTER = 205 "S0205" Warning "filter not applied"
        "Blur, shadow and other filters work on pixels. The element is drawn without its filter."
    PAINT_SERVER = 206 "S0206" Warning "gradient or pattern as a plain colour"
        "A gradient or a pattern paints a stroke or a hatched fill. A pen has one colour: the first of the gradient, or \
         the fallback."
    FOREIGN_OBJECT = 207 "S0207" Warning "foreignObject not drawn"
        "The element holds HTML or another language inside SVG. It is not drawn. Export the drawing with text as SVG \
         text or as paths."
    TEXT_FONT = 208 "S0208" Warning "text in another font"
        "Text is drawn with the built-in single-stroke font at its place, size and anchor; its letters have other \
         shapes and widths than those of the font that the file names. For these, draw text as outlines (--text \
         outlines), or convert it to paths in an editor. The same is reported where outlines come from another font \
         than the one that the file names."
    UNKNOWN_CHARACTER = 209 "S0209" Warning "character not drawn"
        "The font lacks a character. Its place stays empty. Convert the text to paths in an editor."
    TEXT_NOT_DRAWN = 210 "S0210" Warning "text not drawn"
        "Text flowed into a shape by a draft of SVG 1.2, or any text where no font is given, is not drawn. Convert it to \
         paths in an editor."
    HIDDEN = 211 "S0211" Note "hidden elements"
        "Elements with `display:none`, `visibility:hidden` or an opacity of 0 are not drawn, nor are hidden layers, \
         elements for languages other than English, and elements that require extensions."
    ZERO_WIDTH = 213 "S0213" Note "stroke without width"
        "A stroke of width 0 is invisible in every viewer and is not drawn."
    CLIP_NOT_APPLIED = 214 "S0214" Warning "clip path not applied"
        "A clip path made of text, or a shape of CSS such as `inset()` and `circle()`, is not supported. The element is \
         drawn whole."
    TOO_MANY_DASHES = 215 "S0215" Warning "dashes too fine"
        "The dashes of a stroke are so short that the drawing would have millions of them. It is drawn solid."
    HATCH_TOO_FINE = 216 "S0216" Warning "hatch too fine"
        "The hatch of an area would have millions of lines. It is not hatched. Usually the spacing or the size of the \
         drawing is not as intended."
    OUT_OF_RANGE = 217 "S0217" Warning "coordinate out of range"
        "After all transforms a point is more than 25 km from the page's origin. The path is left out."
    ANIMATION = 219 "S0219" Note "script or animation skipped"
        "Scripts and animations are not run: the drawing is what the file holds at rest."
    LAYER_SKIPPED = 220 "S0220" Note "documentation layer"
        "The name of a layer begins with `%`: by the convention of AxiDraw it is not drawn."
    NO_PAINT = 221 "S0221" Note "neither stroke nor fill"
        "A shape has neither a stroke nor a fill: it is invisible and not drawn."
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_names_agree_and_rise() {
        for pair in CODES.windows(2) {
            assert!(pair[0].number < pair[1].number, "{}", pair[1].name);
        }
        for entry in CODES {
            assert_eq!(entry.name, format!("S{:04}", entry.number));
            assert_eq!(Code::from_name(entry.name), Some(Code(entry.number)));
            assert!(entry.explanation.len() > entry.title.len());
        }
    }
}
