//! `report.html`: one page that needs nothing else, like the results section of a paper.

use std::fmt::Write as _;

use anyhow::{Context, Result};

use crate::experiments::{Block, Claim, Picture, Section};
use crate::table::escape;

const STYLE: &str = include_str!("report.css");

/// A page of sections, numbered in their order.
#[derive(Debug, Clone)]
pub(crate) struct Report {
    pub(crate) title: String,
    /// What comes before the first section.
    pub(crate) lead: Vec<Block>,
    pub(crate) sections: Vec<Section>,
}

impl Report {
    /// The text of the page, with all figures in it.
    ///
    /// # Errors
    /// A figure that cannot be drawn.
    pub(crate) fn to_html(&self) -> Result<String> {
        let title = escape(&self.title);
        let mut html = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n"
        );
        self.lead
            .iter()
            .try_for_each(|block| write_block(&mut html, block))?;
        html += &contents(&self.sections);
        for (index, section) in self.sections.iter().enumerate() {
            let number = index + 1;
            let _ = writeln!(
                html,
                "<section id=\"s{number}\">\n<h2>{number}. {}</h2>",
                escape(&section.heading)
            );
            section
                .blocks
                .iter()
                .try_for_each(|block| write_block(&mut html, block))?;
            html.push_str("</section>\n");
        }
        html.push_str("</main>\n</body>\n</html>\n");
        Ok(html)
    }
}

fn contents(sections: &[Section]) -> String {
    let entry = |(index, section): (usize, &Section)| {
        let (number, claims) = (index + 1, section.claims().count());
        let held = section.claims().filter(|claim| claim.holds).count();
        let tally = if claims > 0 {
            format!(" <small>{held} of {claims} claims hold</small>")
        } else {
            String::new()
        };
        format!(
            "<li><a href=\"#s{number}\">{}</a>{tally}</li>\n",
            escape(&section.heading)
        )
    };
    let entries: String = sections.iter().enumerate().map(entry).collect();
    format!("<nav>\n<ol>\n{entries}</ol>\n</nav>\n")
}

fn write_block(html: &mut String, block: &Block) -> Result<()> {
    match block {
        Block::Heading(text) => {
            let _ = writeln!(html, "<h3>{}</h3>", escape(text));
        }
        Block::Text(text) => {
            let _ = writeln!(html, "<p>{}</p>", escape(text));
        }
        Block::Code(text) => {
            let _ = writeln!(html, "<pre>{}</pre>", escape(text));
        }
        Block::Table(table) => {
            let _ = writeln!(html, "<div class=\"wide\">\n{}</div>", table.to_html());
        }
        Block::Picture(picture) => write_picture(html, picture)?,
        Block::Claims(claims) => write_claims(html, claims),
        Block::Linked { path, caption } => {
            let (path, caption) = (escape(path), escape(caption));
            let _ = writeln!(
                html,
                "<figure>\n<div class=\"wide\"><img src=\"{path}\" alt=\"{caption}\"></div>\n<figcaption>{caption}</figcaption>\n</figure>"
            );
        }
    }
    Ok(())
}

fn write_picture(html: &mut String, picture: &Picture) -> Result<()> {
    let svg = picture
        .figure
        .to_svg()
        .with_context(|| format!("figure {}", picture.file))?;
    // Panels side by side are too small for a phone's width: they scroll there.
    let class = if picture.figure.columns > 1 {
        " class=\"pair\""
    } else {
        ""
    };
    let _ = writeln!(
        html,
        "<figure{class}>\n<div class=\"wide\">{svg}</div>\n<figcaption><b>{}.</b> {}</figcaption>\n</figure>",
        escape(&picture.number),
        escape(&picture.caption)
    );
    Ok(())
}

fn write_claims(html: &mut String, claims: &[Claim]) {
    html.push_str("<ul class=\"claims\">\n");
    for claim in claims {
        let (class, mark) = if claim.holds {
            ("holds", "✓")
        } else {
            ("fails", "✗")
        };
        let _ = writeln!(
            html,
            "<li class=\"{class}\"><b class=\"verdict\">{mark} {}</b> {}.<br>\n<span>Paper: {}. Here: {}.</span></li>",
            claim.verdict(),
            escape(&claim.claim),
            escape(&claim.paper),
            escape(&claim.here)
        );
    }
    html.push_str("</ul>\n");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::Table;

    #[test]
    fn a_page_is_whole_and_needs_nothing_else() {
        let mut table = Table::new("T", &["a < b"]);
        table.push(["1"]);
        let claims = vec![Claim::new("so & so", "1", "2", false)];
        let section = Section {
            heading: "One".into(),
            blocks: vec![Block::Table(table), Block::Claims(claims)],
        };
        let report = Report {
            title: "R".into(),
            lead: vec![Block::Text("x < y".into())],
            sections: vec![section],
        };
        let html = report.to_html().unwrap();
        assert!(html.contains("x &lt; y") && html.contains("so &amp; so") && html.contains("a &lt; b"));
        assert!(html.contains("0 of 1 claims hold") && html.contains("✗ does not hold"));
        assert!(!html.contains("<script") && !html.contains("<link") && !html.contains("url("));
        assert_eq!(
            html.matches("<section").count(),
            html.matches("</section>").count()
        );
    }
}
