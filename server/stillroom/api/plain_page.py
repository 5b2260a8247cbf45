"""Pages for whoever follows a link from elsewhere: they need no script, and nothing happens before a button is pressed."""

from html import escape

from starlette.responses import HTMLResponse

from stillroom.service.messages.words import Page, Words


def plain_page(words: Words, page: Page, *, token: str = "", address: str = "", status: int = 200) -> HTMLResponse:
    form = ""
    if page.button:
        form = f'<form method=post action="?token={escape(token, quote=True)}"><button>{escape(page.button)}</button></form>'
    text = escape(page.text.replace("{address}", address))
    return HTMLResponse(
        f"<!doctype html><html lang={words.language}><meta charset=utf-8>"
        f"<meta name=viewport content='width=device-width'><title>{escape(page.title)}</title>"
        "<style>body{font:1.1rem/1.5 sans-serif;max-width:34rem;margin:3rem auto;"
        "padding:0 1rem}button{font:inherit;padding:.6rem 1.2rem;min-height:44px}</style>"
        f"<main><h1>{escape(page.title)}</h1><p>{text}</p>{form}</main></html>",
        status,
        {"Referrer-Policy": "no-referrer", "Cache-Control": "no-store", "Vary": "Accept-Language"},
    )
