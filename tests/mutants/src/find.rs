//! Finds what can be mutated in a source file.
//!
//! The operators are those of cargo-mutants, with both neighbours of each comparison, and some that state machines live
//! by: assignments and calls without a result are left out, conditions that are a mere call or name are reversed.
//! Tests, constants, macros, and what only words things (`Display`, `Debug`) are left alone.

use std::collections::BTreeMap;
use std::ops::Range;

use proc_macro2::{Span, TokenStream};
use syn::spanned::Spanned;
use syn::visit::{self, Visit};
use syn::{BinOp, Block, Expr, Meta, Pat, ReturnType, Stmt, Type, UnOp};

use crate::values;

/// One way to change the program.
#[derive(Clone, Debug)]
pub struct Mutant {
    /// The function it is in.
    pub function: String,
    pub line: usize,
    /// What is there, on one line.
    pub original: String,
    /// What the mutant says instead.
    pub mutated: String,
    /// The text for the branch that is taken when it is on.
    pub text: String,
}

/// How the mutants of a place are written into the source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Shape {
    /// An expression is replaced.
    Expression,
    /// A body returns at once. The range is empty.
    Entry,
    /// An arm does not match. The range is empty.
    Arm,
}

/// The places of a file in their order, a place before those within it, with their mutants.
pub type Places = BTreeMap<(usize, std::cmp::Reverse<usize>, Shape), Vec<Mutant>>;

/// All places of a file.
pub fn places(source: &str) -> syn::Result<Places> {
    let file = syn::parse_file(source)?;
    let mut finder = Finder { source, places: Places::new(), within: Vec::new(), results: Vec::new() };
    finder.visit_file(&file);
    Ok(finder.places)
}

struct Finder<'a> {
    source: &'a str,
    places: Places,
    /// Names of the types and functions around.
    within: Vec<String>,
    /// Whether each body around has no result.
    results: Vec<bool>,
}

impl Finder<'_> {
    fn text(&self, span: Span) -> &str {
        &self.source[span.byte_range()]
    }

    fn add(&mut self, range: Range<usize>, shape: Shape, shown: Span, mutated: &str, text: String) {
        let original = one_line(self.text(shown));
        let mutant = Mutant {
            function: self.within.join("::"),
            line: shown.start().line,
            original,
            mutated: one_line(mutated),
            text,
        };
        let place = self.places.entry((range.start, std::cmp::Reverse(range.end), shape)).or_default();
        if !place.iter().any(|there| there.text == mutant.text) {
            place.push(mutant);
        }
    }

    fn replace(&mut self, span: Span, text: String) {
        self.add(span.byte_range(), Shape::Expression, span, &text.clone(), text);
    }

    fn assigns(&self, both: &syn::ExprBinary) -> bool {
        let operator = self.text(both.op.span());
        operator.ends_with('=') && !COMPARISONS.contains(&operator)
    }

    /// A statement without a result, or something whose value nobody takes.
    fn in_unit_position(&mut self, expr: &Expr) {
        match expr {
            Expr::Binary(found) if !self.assigns(found) => {}
            Expr::Call(_) | Expr::MethodCall(_) | Expr::Assign(_) | Expr::Binary(_) | Expr::Try(_)
                if is_plain(attributes(expr)) =>
            {
                self.add(expr.span().byte_range(), Shape::Expression, expr.span(), "nothing", "()".into());
            }
            Expr::If(found) => {
                self.statements(&found.then_branch, true);
                if let Some((_, otherwise)) = &found.else_branch {
                    self.in_unit_position(otherwise);
                }
            }
            Expr::Match(found) => found.arms.iter().for_each(|arm| self.in_unit_position(&arm.body)),
            Expr::Block(found) => self.statements(&found.block, true),
            _ => {}
        }
    }

    fn statements(&mut self, block: &Block, is_unit: bool) {
        for (number, statement) in block.stmts.iter().enumerate() {
            if let Stmt::Expr(expr, semicolon) = statement
                && (semicolon.is_some() || is_unit || number + 1 < block.stmts.len())
            {
                self.in_unit_position(expr);
            }
        }
    }

    fn function(&mut self, name: String, signature: &syn::Signature, attributes: &[syn::Attribute], block: &Block) {
        if signature.constness.is_some() || !is_plain(attributes) {
            return;
        }
        self.within.push(name);
        let is_unit = matches!(signature.output, ReturnType::Default);
        self.bodies(signature, block);
        self.statements(block, is_unit);
        self.results.push(is_unit);
        self.visit_block(block);
        self.results.pop();
        self.within.pop();
    }

    /// The body is replaced by obvious values.
    fn bodies(&mut self, signature: &syn::Signature, block: &Block) {
        let Some(first) = block.stmts.first() else { return };
        let start = first.span().byte_range().start;
        let whole = one_line(self.text(block.span()));
        let mut add = |value: String| {
            if whole == format!("{{ {value} }}") {
                return;
            }
            let text = format!("return {value};");
            self.add(start..start, Shape::Entry, signature.span(), &text, text.clone());
        };
        match &signature.output {
            ReturnType::Default => add(String::new()),
            ReturnType::Type(_, result) => values::of(result).into_iter().for_each(add),
        }
    }

    fn binary(&mut self, whole: &syn::ExprBinary) {
        let (left, right) = (self.text(whole.left.span()).to_owned(), self.text(whole.right.span()).to_owned());
        let assigns = self.assigns(whole);
        for other in others(&whole.op) {
            let text = if assigns { format!("{left} {other} {right}") } else { format!("({left}) {other} ({right})") };
            let shown = format!("{left} {other} {right}");
            self.add(whole.span().byte_range(), Shape::Expression, whole.span(), &shown, text);
        }
    }

    /// A condition that no operator decides.
    fn condition(&mut self, condition: &Expr) {
        match condition {
            Expr::Call(_) | Expr::MethodCall(_) | Expr::Path(_) | Expr::Field(_) => {
                let text = format!("!{}", self.text(condition.span()));
                self.replace(condition.span(), text);
            }
            Expr::Binary(both) if matches!(both.op, BinOp::And(_) | BinOp::Or(_)) => {
                self.condition(&both.left);
                self.condition(&both.right);
            }
            _ => {}
        }
    }
}

impl<'ast> Visit<'ast> for Finder<'_> {
    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        self.function(item.sig.ident.to_string(), &item.sig, &item.attrs, &item.block);
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        self.function(item.sig.ident.to_string(), &item.sig, &item.attrs, &item.block);
    }

    fn visit_trait_item_fn(&mut self, item: &'ast syn::TraitItemFn) {
        if let Some(block) = &item.default {
            self.function(item.sig.ident.to_string(), &item.sig, &item.attrs, block);
        }
    }

    fn visit_item_impl(&mut self, item: &'ast syn::ItemImpl) {
        let of = item.trait_.as_ref().and_then(|(_, path, _)| path.segments.last()).map(|last| last.ident.to_string());
        if matches!(of.as_deref(), Some("Display" | "Debug")) || !is_plain(&item.attrs) {
            return;
        }
        self.within.push(one_line(self.text(item.self_ty.span())));
        visit::visit_item_impl(self, item);
        self.within.pop();
    }

    fn visit_item_trait(&mut self, item: &'ast syn::ItemTrait) {
        self.within.push(item.ident.to_string());
        visit::visit_item_trait(self, item);
        self.within.pop();
    }

    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if is_plain(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_item_const(&mut self, _: &'ast syn::ItemConst) {}
    fn visit_impl_item_const(&mut self, _: &'ast syn::ImplItemConst) {}
    fn visit_trait_item_const(&mut self, _: &'ast syn::TraitItemConst) {}
    fn visit_item_static(&mut self, _: &'ast syn::ItemStatic) {}
    fn visit_expr_const(&mut self, _: &'ast syn::ExprConst) {}
    fn visit_type(&mut self, _: &'ast Type) {}
    fn visit_pat(&mut self, _: &'ast Pat) {}
    fn visit_attribute(&mut self, _: &'ast syn::Attribute) {}

    fn visit_expr_repeat(&mut self, found: &'ast syn::ExprRepeat) {
        self.visit_expr(&found.expr);
    }

    fn visit_block(&mut self, block: &'ast Block) {
        self.statements(block, false);
        visit::visit_block(self, block);
    }

    fn visit_expr_for_loop(&mut self, found: &'ast syn::ExprForLoop) {
        self.statements(&found.body, true);
        visit::visit_expr_for_loop(self, found);
    }

    fn visit_expr_while(&mut self, found: &'ast syn::ExprWhile) {
        self.statements(&found.body, true);
        self.condition(&found.cond);
        visit::visit_expr_while(self, found);
    }

    fn visit_expr_loop(&mut self, found: &'ast syn::ExprLoop) {
        self.statements(&found.body, true);
        visit::visit_expr_loop(self, found);
    }

    fn visit_expr_if(&mut self, found: &'ast syn::ExprIf) {
        self.condition(&found.cond);
        visit::visit_expr_if(self, found);
    }

    fn visit_expr_binary(&mut self, found: &'ast syn::ExprBinary) {
        // A chain of `let`s is not an expression.
        if !has_let(&found.left) && !has_let(&found.right) {
            self.binary(found);
        }
        visit::visit_expr_binary(self, found);
    }

    fn visit_expr_unary(&mut self, found: &'ast syn::ExprUnary) {
        if matches!(found.op, UnOp::Not(_) | UnOp::Neg(_)) {
            let text = self.text(found.expr.span()).to_owned();
            self.replace(found.span(), text);
        }
        visit::visit_expr_unary(self, found);
    }

    fn visit_expr_match(&mut self, found: &'ast syn::ExprMatch) {
        let has_rest = found.arms.iter().any(|arm| matches!(arm.pat, Pat::Wild(_)) && arm.guard.is_none());
        for arm in &found.arms {
            match &arm.guard {
                Some((_, guard)) if !has_let(guard) => {
                    self.replace(guard.span(), "true".into());
                    self.replace(guard.span(), "false".into());
                }
                None if has_rest && !matches!(arm.pat, Pat::Wild(_)) && is_plain(&arm.attrs) => {
                    let end = arm.pat.span().byte_range().end;
                    self.add(end..end, Shape::Arm, arm.pat.span(), "no such arm", String::new());
                }
                _ => {}
            }
        }
        visit::visit_expr_match(self, found);
    }
}

const COMPARISONS: [&str; 4] = ["==", "!=", "<=", ">="];

/// What may take this operator's place.
fn others(op: &BinOp) -> &'static [&'static str] {
    match op {
        BinOp::Eq(_) => &["!="],
        BinOp::Ne(_) => &["=="],
        BinOp::Lt(_) => &["<=", ">", "=="],
        BinOp::Gt(_) => &[">=", "<", "=="],
        BinOp::Le(_) => &["<", ">"],
        BinOp::Ge(_) => &[">", "<"],
        BinOp::And(_) => &["||"],
        BinOp::Or(_) => &["&&"],
        BinOp::Add(_) => &["-", "*"],
        BinOp::Sub(_) => &["+", "/"],
        BinOp::Mul(_) => &["+", "/"],
        BinOp::Div(_) => &["%", "*"],
        BinOp::Rem(_) => &["/", "+"],
        BinOp::BitAnd(_) => &["|", "^"],
        BinOp::BitOr(_) => &["&", "^"],
        BinOp::BitXor(_) => &["|", "&"],
        BinOp::Shl(_) => &[">>"],
        BinOp::Shr(_) => &["<<"],
        BinOp::AddAssign(_) => &["-=", "*="],
        BinOp::SubAssign(_) => &["+=", "/="],
        BinOp::MulAssign(_) => &["+=", "/="],
        BinOp::DivAssign(_) => &["%=", "*="],
        BinOp::RemAssign(_) => &["/=", "+="],
        BinOp::BitAndAssign(_) => &["|=", "^="],
        BinOp::BitOrAssign(_) => &["&=", "^="],
        BinOp::BitXorAssign(_) => &["|=", "&="],
        BinOp::ShlAssign(_) => &[">>="],
        BinOp::ShrAssign(_) => &["<<="],
        _ => &[],
    }
}

fn has_let(expr: &Expr) -> bool {
    match expr {
        Expr::Let(_) => true,
        Expr::Binary(both) => has_let(&both.left) || has_let(&both.right),
        _ => false,
    }
}

fn attributes(expr: &Expr) -> &[syn::Attribute] {
    match expr {
        Expr::Call(found) => &found.attrs,
        Expr::MethodCall(found) => &found.attrs,
        Expr::Assign(found) => &found.attrs,
        Expr::Binary(found) => &found.attrs,
        Expr::Try(found) => &found.attrs,
        _ => &[],
    }
}

/// Whether it is compiled in every build.
fn is_plain(attributes: &[syn::Attribute]) -> bool {
    let is_test = |tokens: &TokenStream| tokens.to_string().split(|c: char| !c.is_alphanumeric()).any(|w| w == "test");
    !attributes.iter().any(|attribute| match &attribute.meta {
        Meta::List(list) => list.path.is_ident("cfg") && is_test(&list.tokens),
        Meta::Path(path) => path.is_ident("test"),
        Meta::NameValue(_) => false,
    })
}

/// Text with every run of blanks as one.
fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
