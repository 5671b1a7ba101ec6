"""200 strings that a tokeniser can get wrong."""

LONG = "a small red wooden chair beside the large blue table with four legs and "

FIXED = [
    "", " ", "\t\n\r", "   leading and trailing   ", "many    inner     spaces", "tab\tand\nnewline\r\nmix", "\u00a0no-break\u00a0space\u00a0",
    "thin\u2009space em\u2003space ideographic\u3000space", "zero\u200bwidth\u200bspace", "soft\u00adhyphen", "word\u2060joiner", "\ufeffbyte order mark",
    "line\u2028separator paragraph\u2029separator", "next\x85line", "vertical\x0btab form\x0cfeed", "null\x00byte", "bell\x07 escape\x1b[31mred\x1b[0m", "file\x1cseparator",
    "don't", "DON'T", "it's the cat's", "we're they've I'm she'll he'd", "'s", "'S 'T 'RE", "''''", "rock 'n' roll", "o'clock o'neill", "don\u2019t it\u2019s",
    "\u2018single\u2019 \u201cdouble\u201d", "\u00abguillemets\u00bb", "students' books", "'tis 'twas", "y'all'd've", "the dog's'",
    "0", "007", "1234567890", "3.14159", "1,000,000", "-40\u00b0C", "2 x 4", "50%", "1/2 cup", "\u00bd cup \u00be", "\u00b2\u00b3 x\u2074", "No. 5", "A4 paper", "mp3 player", "7up",
    "\u0661\u0662\u0663", "\u0967\u0968\u0969", "\uff11\uff12\uff13", "\u2160\u2161\u2162 roman", "\u2460\u2461", "10e-5", "0x1F", "1st 2nd 3rd", "12:30pm", "2024-01-31",
    "UPPER CASE", "MiXeD CaSe", "camelCaseWord", "snake_case_word", "kebab-case-word", "aerosol_can", "__init__", "ALLCAPSWITHOUTSPACES",
    "stra\u00dfe", "STRASSE \u1e9e", "\u0130stanbul \u0131s\u0131", "\u01c4 \u01c5 \u01c6", "\u03a3\u038a\u03a3\u03a5\u03a6\u039f\u03a3", "\u00c5ngstr\u00f6m \u212bngstr\u00f6m", "K \u212a", "\u00b5 \u03bc",
    "caf\u00e9", "cafe\u0301", "na\u00efve", "nai\u0308ve", "Zo\u00eb Zoe\u0308", "\u1e9b\u0323", "a\u0300\u0301\u0302\u0303", "\u0301leading mark", "e\u0301\u0301", "\u1100\u1161\u11a8 \uac01",
    "\ufb01sh \ufb02oor \ufb00", "\uff28\uff45\uff4c\uff4c\uff4f", "\uff76\uff80\uff76\uff85", "\u337f", "\u2122 \u00ae \u00a9", "\u2026 ...", "\u2013 \u2014 - \u2212", "\u2044 / \u2215",
    "\u732b", "\u4e00\u53ea\u7ea2\u8272\u7684\u732b", "\u8d64\u3044\u30ea\u30f3\u30b4", "\u3053\u3093\u306b\u3061\u306f\u4e16\u754c", "\u6771\u4eac\u30bf\u30ef\u30fc123", "\ube68\uac04 \uc0ac\uacfc", "\uc548\ub155\ud558\uc138\uc694", "\u9f8d\u9f8d\u9f8d", "\U00020000\U00020001", "\u3001\u3002\u300c\u300d",
    "\u0642\u0637\u0629 \u062d\u0645\u0631\u0627\u0621", "\u0627\u0644\u0633\u064e\u0651\u0644\u0627\u0645", "\u05d7\u05ea\u05d5\u05dc \u05d0\u05d3\u05d5\u05dd", "\u0645\u06cc\u200c\u062e\u0648\u0627\u0647\u0645", "\u202bright to left\u202c", "\u200eleft\u200fright",
    "\u043a\u0440\u0430\u0441\u043d\u0430\u044f \u043a\u043e\u0448\u043a\u0430", "\u041a\u0420\u0410\u0421\u041d\u0410\u042f", "\u0451\u0436\u0438\u043a \u0419\u043e\u0434", "\u03ba\u03cc\u03ba\u03ba\u03b9\u03bd\u03b7 \u03b3\u03ac\u03c4\u03b1", "\u0932\u093e\u0932 \u092c\u093f\u0932\u094d\u0932\u0940", "\u0e41\u0e21\u0e27\u0e2a\u0e35\u0e41\u0e14\u0e07", "\u1019\u103c\u1014\u103a\u1019\u102c", "\u10e9\u10d0\u10d8", "\u0531\u0532\u0533", "\u13a0\u13a1\u13a2 \uab70",
    "\U0001f600", "\U0001f431\U0001f436", "cat \U0001f431 dog", "\U0001f468\u200d\U0001f469\u200d\U0001f467\u200d\U0001f466", "\U0001f44d\U0001f3fd", "\U0001f1e9\U0001f1ea", "\u2764\ufe0f \u2764", "1\ufe0f\u20e3", "\u2603 \u2620 \u2708", "\U0001d49c\U0001d4b7\U0001d4b8", "\U0001f170\U0001f17e",
    "&amp;", "&lt;b&gt;bold&lt;/b&gt;", "&amp;amp;", "&amp;lt;", "&amp;amp;lt;", "&quot;quoted&quot;", "&#39;s", "&#x27;s", "it&#39;s", "&nbsp;space&nbsp;", "&eacute;t&eacute;", "&#233; &#xE9;",
    "&copy 2024", "&notanentity;", "&amp", "R&D", "&#0;", "&#128;", "&#1114112;", "&#x1F600;", "&hearts;&spades;", "&NotEqualTilde;", "<b>bold</b>", "<start_of_text>", "<end_of_text>", "a <END_OF_TEXT> b", "<|endoftext|>", "<start_of_text>cat<end_of_text>",
    "hello, world!", "wait...what?!", "C++ & C#", "$9.99", "\u20ac5 \u00a37 \u00a59", "a@b.example", "http://example.org/a?b=c&d=e#f", "#hashtag @mention", "(round) [square] {curly}", "back\\slash", "~`!@#$%^&*()_+-=", "a|b|c", "<<<>>>", "\"\"\"", "!!!!!!!!!!", ":-) ;-) :D", "\u00bfqu\u00e9? \u00a1s\u00ed!",
    "\u00c3\u00a9t\u00c3\u00a9", "\u00e2\u20ac\u0153quoted\u00e2\u20ac\u009d", "don\u00e2\u20ac\u2122t", "\u00c2\u00a0x", "l\u00c3\u00a2che", "schï¿½n", "\ufffd", "\u00f0\u0178\u02dc\u20ac", "\ud55c&#44397;",
    "supercalifragilisticexpialidocious", "pneumonoultramicroscopicsilicovolcanoconiosis", "qwertyuiopasdfghjklzxcvbnm", "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx", "a b c d e f g h i j k l m n o p q r s t u v w x y z",
    LONG * 5, LONG * 50, "a " * 75, "a " * 76, "a " * 74, "\u732b" * 100, "x" * 1000, "\U0001f600" * 60, "1" * 200, "'" * 90, "word" * 80,
]


def strings():
    if len(set(FIXED)) != 200:
        raise SystemExit(f"{len(set(FIXED))} strings, not 200")
    return list(FIXED)
