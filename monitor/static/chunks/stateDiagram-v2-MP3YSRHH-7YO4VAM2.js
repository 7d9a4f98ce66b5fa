import{b as Wt}from"./chunk-BMBGUGZT.js";import{B as Nt,C as $t,D as Bt,E as Pt,F as Ft,G as Gt,H as Yt,I as N,L as B,N as ke,R as Vt,U as Mt,a as h,b as T,d as Rt,x as W,y as Ot}from"./chunk-UZJ333AM.js";import{b as Ee}from"./chunk-6DHFEWGX.js";var jt=h((t,e)=>{let i;return e==="sandbox"&&(i=B("#i"+t)),(e==="sandbox"?B(i.nodes()[0].contentDocument.body):B("body")).select(`[id="${t}"]`)},"getDiagramElement");var Ut=h((t,e,i,s)=>{t.attr("class",i);let{width:o,height:d,x:p,y}=_e(t,e);Ot(t,d,o,s);let n=xe(p,y,o,d,e);t.attr("viewBox",n),T.debug(`viewBox configured: ${n} with padding: ${e}`)},"setupViewPortForSVG"),_e=h((t,e)=>{let i=t.node()?.getBBox()||{width:0,height:0,x:0,y:0};return{width:i.width+e*2,height:i.height+e*2,x:i.x,y:i.y}},"calculateDimensionsWithPadding"),xe=h((t,e,i,s,o)=>`${t-o} ${e-o} ${i} ${s}`,"createViewBox");var ve=Ee(ke(),1);var zt=h(()=>{let t=B(".mermaidTooltip");return t.empty()&&(t=B("body").append("div").attr("class","mermaidTooltip").style("opacity",0).style("position","absolute").style("text-align","center").style("max-width","200px").style("padding","2px").style("font-size","12px").style("background","#ffffde").style("border","1px solid #333").style("border-radius","2px").style("pointer-events","none").style("z-index","100")),t},"createTooltip");var Dt=(function(){var t=h(function(M,l,u,a){for(u=u||{},a=M.length;a--;u[M[a]]=l);return u},"o"),e=[1,2],i=[1,3],s=[1,4],o=[2,4],d=[1,9],p=[1,11],y=[1,16],n=[1,17],m=[1,18],E=[1,19],R=[1,33],A=[1,20],_=[1,21],f=[1,22],L=[1,23],$=[1,24],D=[1,26],P=[1,27],C=[1,28],F=[1,29],w=[1,30],H=[1,31],it=[1,32],at=[1,35],nt=[1,36],ot=[1,37],lt=[1,38],K=[1,34],S=[1,4,5,16,17,19,21,22,24,25,26,27,28,29,33,35,37,38,41,45,48,51,52,53,54,57],ct=[1,4,5,14,15,16,17,19,21,22,24,25,26,27,28,29,33,35,37,38,39,40,41,45,48,51,52,53,54,57],Lt=[4,5,16,17,19,21,22,24,25,26,27,28,29,33,35,37,38,41,45,48,51,52,53,54,57],mt={trace:h(function(){},"trace"),yy:{},symbols_:{error:2,start:3,SPACE:4,NL:5,SD:6,document:7,line:8,statement:9,classDefStatement:10,styleStatement:11,cssClassStatement:12,idStatement:13,DESCR:14,"-->":15,HIDE_EMPTY:16,scale:17,WIDTH:18,COMPOSIT_STATE:19,STRUCT_START:20,STRUCT_STOP:21,STATE_DESCR:22,AS:23,ID:24,FORK:25,JOIN:26,CHOICE:27,CONCURRENT:28,note:29,notePosition:30,NOTE_TEXT:31,direction:32,acc_title:33,acc_title_value:34,acc_descr:35,acc_descr_value:36,acc_descr_multiline_value:37,CLICK:38,STRING:39,HREF:40,classDef:41,CLASSDEF_ID:42,CLASSDEF_STYLEOPTS:43,DEFAULT:44,style:45,STYLE_IDS:46,STYLEDEF_STYLEOPTS:47,class:48,CLASSENTITY_IDS:49,STYLECLASS:50,direction_tb:51,direction_bt:52,direction_rl:53,direction_lr:54,eol:55,";":56,EDGE_STATE:57,STYLE_SEPARATOR:58,left_of:59,right_of:60,$accept:0,$end:1},terminals_:{2:"error",4:"SPACE",5:"NL",6:"SD",14:"DESCR",15:"-->",16:"HIDE_EMPTY",17:"scale",18:"WIDTH",19:"COMPOSIT_STATE",20:"STRUCT_START",21:"STRUCT_STOP",22:"STATE_DESCR",23:"AS",24:"ID",25:"FORK",26:"JOIN",27:"CHOICE",28:"CONCURRENT",29:"note",31:"NOTE_TEXT",33:"acc_title",34:"acc_title_value",35:"acc_descr",36:"acc_descr_value",37:"acc_descr_multiline_value",38:"CLICK",39:"STRING",40:"HREF",41:"classDef",42:"CLASSDEF_ID",43:"CLASSDEF_STYLEOPTS",44:"DEFAULT",45:"style",46:"STYLE_IDS",47:"STYLEDEF_STYLEOPTS",48:"class",49:"CLASSENTITY_IDS",50:"STYLECLASS",51:"direction_tb",52:"direction_bt",53:"direction_rl",54:"direction_lr",56:";",57:"EDGE_STATE",58:"STYLE_SEPARATOR",59:"left_of",60:"right_of"},productions_:[0,[3,2],[3,2],[3,2],[7,0],[7,2],[8,2],[8,1],[8,1],[9,1],[9,1],[9,1],[9,1],[9,2],[9,3],[9,4],[9,1],[9,2],[9,1],[9,4],[9,3],[9,6],[9,1],[9,1],[9,1],[9,1],[9,4],[9,4],[9,1],[9,2],[9,2],[9,1],[9,5],[9,5],[10,3],[10,3],[11,3],[12,3],[32,1],[32,1],[32,1],[32,1],[55,1],[55,1],[13,1],[13,1],[13,3],[13,3],[30,1],[30,1]],performAction:h(function(l,u,a,g,b,r,X){var c=r.length-1;switch(b){case 3:return g.setRootDoc(r[c]),r[c];break;case 4:this.$=[];break;case 5:r[c]!="nl"&&(r[c-1].push(r[c]),this.$=r[c-1]);break;case 6:case 7:this.$=r[c];break;case 8:this.$="nl";break;case 12:this.$=r[c];break;case 13:let dt=r[c-1];dt.description=g.trimColon(r[c]),this.$=dt;break;case 14:this.$={stmt:"relation",state1:r[c-2],state2:r[c]};break;case 15:let ut=g.trimColon(r[c]);this.$={stmt:"relation",state1:r[c-3],state2:r[c-1],description:ut};break;case 19:this.$={stmt:"state",id:r[c-3],type:"default",description:"",doc:r[c-1]};break;case 20:var G=r[c],Y=r[c-2].trim();if(r[c].match(":")){var Z=r[c].split(":");G=Z[0],Y=[Y,Z[1]]}this.$={stmt:"state",id:G,type:"default",description:Y};break;case 21:this.$={stmt:"state",id:r[c-3],type:"default",description:r[c-5],doc:r[c-1]};break;case 22:this.$={stmt:"state",id:r[c],type:"fork"};break;case 23:this.$={stmt:"state",id:r[c],type:"join"};break;case 24:this.$={stmt:"state",id:r[c],type:"choice"};break;case 25:this.$={stmt:"state",id:g.getDividerId(),type:"divider"};break;case 26:this.$={stmt:"state",id:r[c-1].trim(),note:{position:r[c-2].trim(),text:r[c].trim()}};break;case 29:this.$=r[c].trim(),g.setAccTitle(this.$);break;case 30:case 31:this.$=r[c].trim(),g.setAccDescription(this.$);break;case 32:this.$={stmt:"click",id:r[c-3],url:r[c-2],tooltip:r[c-1]};break;case 33:this.$={stmt:"click",id:r[c-3],url:r[c-1],tooltip:""};break;case 34:case 35:this.$={stmt:"classDef",id:r[c-1].trim(),classes:r[c].trim()};break;case 36:this.$={stmt:"style",id:r[c-1].trim(),styleClass:r[c].trim()};break;case 37:this.$={stmt:"applyClass",id:r[c-1].trim(),styleClass:r[c].trim()};break;case 38:g.setDirection("TB"),this.$={stmt:"dir",value:"TB"};break;case 39:g.setDirection("BT"),this.$={stmt:"dir",value:"BT"};break;case 40:g.setDirection("RL"),this.$={stmt:"dir",value:"RL"};break;case 41:g.setDirection("LR"),this.$={stmt:"dir",value:"LR"};break;case 44:case 45:this.$={stmt:"state",id:r[c].trim(),type:"default",description:""};break;case 46:this.$={stmt:"state",id:r[c-2].trim(),classes:[r[c].trim()],type:"default",description:""};break;case 47:this.$={stmt:"state",id:r[c-2].trim(),classes:[r[c].trim()],type:"default",description:""};break}},"anonymous"),table:[{3:1,4:e,5:i,6:s},{1:[3]},{3:5,4:e,5:i,6:s},{3:6,4:e,5:i,6:s},t([1,4,5,16,17,19,22,24,25,26,27,28,29,33,35,37,38,41,45,48,51,52,53,54,57],o,{7:7}),{1:[2,1]},{1:[2,2]},{1:[2,3],4:d,5:p,8:8,9:10,10:12,11:13,12:14,13:15,16:y,17:n,19:m,22:E,24:R,25:A,26:_,27:f,28:L,29:$,32:25,33:D,35:P,37:C,38:F,41:w,45:H,48:it,51:at,52:nt,53:ot,54:lt,57:K},t(S,[2,5]),{9:39,10:12,11:13,12:14,13:15,16:y,17:n,19:m,22:E,24:R,25:A,26:_,27:f,28:L,29:$,32:25,33:D,35:P,37:C,38:F,41:w,45:H,48:it,51:at,52:nt,53:ot,54:lt,57:K},t(S,[2,7]),t(S,[2,8]),t(S,[2,9]),t(S,[2,10]),t(S,[2,11]),t(S,[2,12],{14:[1,40],15:[1,41]}),t(S,[2,16]),{18:[1,42]},t(S,[2,18],{20:[1,43]}),{23:[1,44]},t(S,[2,22]),t(S,[2,23]),t(S,[2,24]),t(S,[2,25]),{30:45,31:[1,46],59:[1,47],60:[1,48]},t(S,[2,28]),{34:[1,49]},{36:[1,50]},t(S,[2,31]),{13:51,24:R,57:K},{42:[1,52],44:[1,53]},{46:[1,54]},{49:[1,55]},t(ct,[2,44],{58:[1,56]}),t(ct,[2,45],{58:[1,57]}),t(S,[2,38]),t(S,[2,39]),t(S,[2,40]),t(S,[2,41]),t(S,[2,6]),t(S,[2,13]),{13:58,24:R,57:K},t(S,[2,17]),t(Lt,o,{7:59}),{24:[1,60]},{24:[1,61]},{23:[1,62]},{24:[2,48]},{24:[2,49]},t(S,[2,29]),t(S,[2,30]),{39:[1,63],40:[1,64]},{43:[1,65]},{43:[1,66]},{47:[1,67]},{50:[1,68]},{24:[1,69]},{24:[1,70]},t(S,[2,14],{14:[1,71]}),{4:d,5:p,8:8,9:10,10:12,11:13,12:14,13:15,16:y,17:n,19:m,21:[1,72],22:E,24:R,25:A,26:_,27:f,28:L,29:$,32:25,33:D,35:P,37:C,38:F,41:w,45:H,48:it,51:at,52:nt,53:ot,54:lt,57:K},t(S,[2,20],{20:[1,73]}),{31:[1,74]},{24:[1,75]},{39:[1,76]},{39:[1,77]},t(S,[2,34]),t(S,[2,35]),t(S,[2,36]),t(S,[2,37]),t(ct,[2,46]),t(ct,[2,47]),t(S,[2,15]),t(S,[2,19]),t(Lt,o,{7:78}),t(S,[2,26]),t(S,[2,27]),{5:[1,79]},{5:[1,80]},{4:d,5:p,8:8,9:10,10:12,11:13,12:14,13:15,16:y,17:n,19:m,21:[1,81],22:E,24:R,25:A,26:_,27:f,28:L,29:$,32:25,33:D,35:P,37:C,38:F,41:w,45:H,48:it,51:at,52:nt,53:ot,54:lt,57:K},t(S,[2,32]),t(S,[2,33]),t(S,[2,21])],defaultActions:{5:[2,1],6:[2,2],47:[2,48],48:[2,49]},parseError:h(function(l,u){if(u.recoverable)this.trace(l);else{var a=new Error(l);throw a.hash=u,a}},"parseError"),parse:h(function(l){var u=this,a=[0],g=[],b=[null],r=[],X=this.table,c="",G=0,Y=0,Z=0,dt=2,ut=1,me=r.slice.call(arguments,1),k=Object.create(this.lexer),U={yy:{}};for(var bt in this.yy)Object.prototype.hasOwnProperty.call(this.yy,bt)&&(U.yy[bt]=this.yy[bt]);k.setInput(l,U.yy),U.yy.lexer=k,U.yy.parser=this,typeof k.yylloc>"u"&&(k.yylloc={});var Tt=k.yylloc;r.push(Tt);var be=k.options&&k.options.ranges;typeof U.yy.parseError=="function"?this.parseError=U.yy.parseError:this.parseError=Object.getPrototypeOf(this).parseError;function Te(I){a.length=a.length-2*I,b.length=b.length-I,r.length=r.length-I}h(Te,"popStack");function wt(){var I;return I=g.pop()||k.lex()||ut,typeof I!="number"&&(I instanceof Array&&(g=I,I=g.pop()),I=u.symbols_[I]||I),I}h(wt,"lex");for(var x,Et,z,O,qe,kt,J={},ft,V,It,pt;;){if(z=a[a.length-1],this.defaultActions[z]?O=this.defaultActions[z]:((x===null||typeof x>"u")&&(x=wt()),O=X[z]&&X[z][x]),typeof O>"u"||!O.length||!O[0]){var _t="";pt=[];for(ft in X[z])this.terminals_[ft]&&ft>dt&&pt.push("'"+this.terminals_[ft]+"'");k.showPosition?_t="Parse error on line "+(G+1)+`:
`+k.showPosition()+`
Expecting `+pt.join(", ")+", got '"+(this.terminals_[x]||x)+"'":_t="Parse error on line "+(G+1)+": Unexpected "+(x==ut?"end of input":"'"+(this.terminals_[x]||x)+"'"),this.parseError(_t,{text:k.match,token:this.terminals_[x]||x,line:k.yylineno,loc:Tt,expected:pt})}if(O[0]instanceof Array&&O.length>1)throw new Error("Parse Error: multiple actions possible at state: "+z+", token: "+x);switch(O[0]){case 1:a.push(x),b.push(k.yytext),r.push(k.yylloc),a.push(O[1]),x=null,Et?(x=Et,Et=null):(Y=k.yyleng,c=k.yytext,G=k.yylineno,Tt=k.yylloc,Z>0&&Z--);break;case 2:if(V=this.productions_[O[1]][1],J.$=b[b.length-V],J._$={first_line:r[r.length-(V||1)].first_line,last_line:r[r.length-1].last_line,first_column:r[r.length-(V||1)].first_column,last_column:r[r.length-1].last_column},be&&(J._$.range=[r[r.length-(V||1)].range[0],r[r.length-1].range[1]]),kt=this.performAction.apply(J,[c,Y,G,U.yy,O[1],b,r].concat(me)),typeof kt<"u")return kt;V&&(a=a.slice(0,-1*V*2),b=b.slice(0,-1*V),r=r.slice(0,-1*V)),a.push(this.productions_[O[1]][0]),b.push(J.$),r.push(J._$),It=X[a[a.length-2]][a[a.length-1]],a.push(It);break;case 3:return!0}}return!0},"parse")},ge=(function(){var M={EOF:1,parseError:h(function(u,a){if(this.yy.parser)this.yy.parser.parseError(u,a);else throw new Error(u)},"parseError"),setInput:h(function(l,u){return this.yy=u||this.yy||{},this._input=l,this._more=this._backtrack=this.done=!1,this.yylineno=this.yyleng=0,this.yytext=this.matched=this.match="",this.conditionStack=["INITIAL"],this.yylloc={first_line:1,first_column:0,last_line:1,last_column:0},this.options.ranges&&(this.yylloc.range=[0,0]),this.offset=0,this},"setInput"),input:h(function(){var l=this._input[0];this.yytext+=l,this.yyleng++,this.offset++,this.match+=l,this.matched+=l;var u=l.match(/(?:\r\n?|\n).*/g);return u?(this.yylineno++,this.yylloc.last_line++):this.yylloc.last_column++,this.options.ranges&&this.yylloc.range[1]++,this._input=this._input.slice(1),l},"input"),unput:h(function(l){var u=l.length,a=l.split(/(?:\r\n?|\n)/g);this._input=l+this._input,this.yytext=this.yytext.substr(0,this.yytext.length-u),this.offset-=u;var g=this.match.split(/(?:\r\n?|\n)/g);this.match=this.match.substr(0,this.match.length-1),this.matched=this.matched.substr(0,this.matched.length-1),a.length-1&&(this.yylineno-=a.length-1);var b=this.yylloc.range;return this.yylloc={first_line:this.yylloc.first_line,last_line:this.yylineno+1,first_column:this.yylloc.first_column,last_column:a?(a.length===g.length?this.yylloc.first_column:0)+g[g.length-a.length].length-a[0].length:this.yylloc.first_column-u},this.options.ranges&&(this.yylloc.range=[b[0],b[0]+this.yyleng-u]),this.yyleng=this.yytext.length,this},"unput"),more:h(function(){return this._more=!0,this},"more"),reject:h(function(){if(this.options.backtrack_lexer)this._backtrack=!0;else return this.parseError("Lexical error on line "+(this.yylineno+1)+`. You can only invoke reject() in the lexer when the lexer is of the backtracking persuasion (options.backtrack_lexer = true).
`+this.showPosition(),{text:"",token:null,line:this.yylineno});return this},"reject"),less:h(function(l){this.unput(this.match.slice(l))},"less"),pastInput:h(function(){var l=this.matched.substr(0,this.matched.length-this.match.length);return(l.length>20?"...":"")+l.substr(-20).replace(/\n/g,"")},"pastInput"),upcomingInput:h(function(){var l=this.match;return l.length<20&&(l+=this._input.substr(0,20-l.length)),(l.substr(0,20)+(l.length>20?"...":"")).replace(/\n/g,"")},"upcomingInput"),showPosition:h(function(){var l=this.pastInput(),u=new Array(l.length+1).join("-");return l+this.upcomingInput()+`
`+u+"^"},"showPosition"),test_match:h(function(l,u){var a,g,b;if(this.options.backtrack_lexer&&(b={yylineno:this.yylineno,yylloc:{first_line:this.yylloc.first_line,last_line:this.last_line,first_column:this.yylloc.first_column,last_column:this.yylloc.last_column},yytext:this.yytext,match:this.match,matches:this.matches,matched:this.matched,yyleng:this.yyleng,offset:this.offset,_more:this._more,_input:this._input,yy:this.yy,conditionStack:this.conditionStack.slice(0),done:this.done},this.options.ranges&&(b.yylloc.range=this.yylloc.range.slice(0))),g=l[0].match(/(?:\r\n?|\n).*/g),g&&(this.yylineno+=g.length),this.yylloc={first_line:this.yylloc.last_line,last_line:this.yylineno+1,first_column:this.yylloc.last_column,last_column:g?g[g.length-1].length-g[g.length-1].match(/\r?\n?/)[0].length:this.yylloc.last_column+l[0].length},this.yytext+=l[0],this.match+=l[0],this.matches=l,this.yyleng=this.yytext.length,this.options.ranges&&(this.yylloc.range=[this.offset,this.offset+=this.yyleng]),this._more=!1,this._backtrack=!1,this._input=this._input.slice(l[0].length),this.matched+=l[0],a=this.performAction.call(this,this.yy,this,u,this.conditionStack[this.conditionStack.length-1]),this.done&&this._input&&(this.done=!1),a)return a;if(this._backtrack){for(var r in b)this[r]=b[r];return!1}return!1},"test_match"),next:h(function(){if(this.done)return this.EOF;this._input||(this.done=!0);var l,u,a,g;this._more||(this.yytext="",this.match="");for(var b=this._currentRules(),r=0;r<b.length;r++)if(a=this._input.match(this.rules[b[r]]),a&&(!u||a[0].length>u[0].length)){if(u=a,g=r,this.options.backtrack_lexer){if(l=this.test_match(a,b[r]),l!==!1)return l;if(this._backtrack){u=!1;continue}else return!1}else if(!this.options.flex)break}return u?(l=this.test_match(u,b[g]),l!==!1?l:!1):this._input===""?this.EOF:this.parseError("Lexical error on line "+(this.yylineno+1)+`. Unrecognized text.
`+this.showPosition(),{text:"",token:null,line:this.yylineno})},"next"),lex:h(function(){var u=this.next();return u||this.lex()},"lex"),begin:h(function(u){this.conditionStack.push(u)},"begin"),popState:h(function(){var u=this.conditionStack.length-1;return u>0?this.conditionStack.pop():this.conditionStack[0]},"popState"),_currentRules:h(function(){return this.conditionStack.length&&this.conditionStack[this.conditionStack.length-1]?this.conditions[this.conditionStack[this.conditionStack.length-1]].rules:this.conditions.INITIAL.rules},"_currentRules"),topState:h(function(u){return u=this.conditionStack.length-1-Math.abs(u||0),u>=0?this.conditionStack[u]:"INITIAL"},"topState"),pushState:h(function(u){this.begin(u)},"pushState"),stateStackSize:h(function(){return this.conditionStack.length},"stateStackSize"),options:{"case-insensitive":!0},performAction:h(function(u,a,g,b){function r(){let c=a.yytext.indexOf("%%");if(c===0)return!1;if(c>0){let G=a.yytext.slice(0,c),Y=a.yytext.slice(c);Y&&u.lexer.unput(Y),a.yytext=G}return!0}h(r,"processId");var X=b;switch(g){case 0:return 38;case 1:return 40;case 2:return 39;case 3:return 44;case 4:return 51;case 5:return 52;case 6:return 53;case 7:return 54;case 8:return 5;case 9:break;case 10:break;case 11:break;case 12:break;case 13:return this.pushState("SCALE"),17;break;case 14:return 18;case 15:this.popState();break;case 16:return this.begin("acc_title"),33;break;case 17:return this.popState(),"acc_title_value";break;case 18:return this.begin("acc_descr"),35;break;case 19:return this.popState(),"acc_descr_value";break;case 20:this.begin("acc_descr_multiline");break;case 21:this.popState();break;case 22:return"acc_descr_multiline_value";case 23:return this.pushState("CLASSDEF"),41;break;case 24:return this.popState(),this.pushState("CLASSDEFID"),"DEFAULT_CLASSDEF_ID";break;case 25:return this.popState(),this.pushState("CLASSDEFID"),42;break;case 26:return this.popState(),43;break;case 27:return this.pushState("CLASS"),48;break;case 28:return this.popState(),this.pushState("CLASS_STYLE"),49;break;case 29:return this.popState(),50;break;case 30:return this.pushState("STYLE"),45;break;case 31:return this.popState(),this.pushState("STYLEDEF_STYLES"),46;break;case 32:return this.popState(),47;break;case 33:return this.pushState("SCALE"),17;break;case 34:return 18;case 35:this.popState();break;case 36:this.pushState("STATE");break;case 37:return this.popState(),a.yytext=a.yytext.slice(0,-8).trim(),25;break;case 38:return this.popState(),a.yytext=a.yytext.slice(0,-8).trim(),26;break;case 39:return this.popState(),a.yytext=a.yytext.slice(0,-10).trim(),27;break;case 40:return this.popState(),a.yytext=a.yytext.slice(0,-8).trim(),25;break;case 41:return this.popState(),a.yytext=a.yytext.slice(0,-8).trim(),26;break;case 42:return this.popState(),a.yytext=a.yytext.slice(0,-10).trim(),27;break;case 43:return 51;case 44:return 52;case 45:return 53;case 46:return 54;case 47:this.pushState("STATE_STRING");break;case 48:return this.pushState("STATE_ID"),"AS";break;case 49:if(!r())return;return this.popState(),"ID";break;case 50:this.popState();break;case 51:return"STATE_DESCR";case 52:throw new Error('Error: State name must be a single word. Found: "'+a.yytext.trim()+'"');case 53:return 19;case 54:this.popState();break;case 55:return this.popState(),this.pushState("struct"),20;break;case 56:return this.popState(),21;break;case 57:break;case 58:return this.begin("NOTE"),29;break;case 59:return this.popState(),this.pushState("NOTE_ID"),59;break;case 60:return this.popState(),this.pushState("NOTE_ID"),60;break;case 61:this.popState(),this.pushState("FLOATING_NOTE");break;case 62:return this.popState(),this.pushState("FLOATING_NOTE_ID"),"AS";break;case 63:break;case 64:return"NOTE_TEXT";case 65:if(!r())return;return this.popState(),"ID";break;case 66:if(!r())return;return this.popState(),this.pushState("NOTE_TEXT"),24;break;case 67:return this.popState(),a.yytext=a.yytext.substr(2).trim(),31;break;case 68:return this.popState(),a.yytext=a.yytext.slice(0,-8).trim(),31;break;case 69:return 6;case 70:return 6;case 71:return 16;case 72:return 57;case 73:return r()?24:void 0;case 74:return a.yytext=a.yytext.trim(),14;break;case 75:return 15;case 76:return 28;case 77:return 58;case 78:return 5;case 79:return"INVALID"}},"anonymous"),rules:[/^(?:click\b)/i,/^(?:href\b)/i,/^(?:"[^"]*")/i,/^(?:default\b)/i,/^(?:.*direction\s+TB[^\n]*)/i,/^(?:.*direction\s+BT[^\n]*)/i,/^(?:.*direction\s+RL[^\n]*)/i,/^(?:.*direction\s+LR[^\n]*)/i,/^(?:[\n]+)/i,/^(?:[\s]+)/i,/^(?:((?!\n)\s)+)/i,/^(?:#[^\n]*)/i,/^(?:%%(?!\{)[^\n]*)/i,/^(?:scale\s+)/i,/^(?:\d+)/i,/^(?:\s+width\b)/i,/^(?:accTitle\s*:\s*)/i,/^(?:(?!\n||)*[^\n]*)/i,/^(?:accDescr\s*:\s*)/i,/^(?:(?!\n||)*[^\n]*)/i,/^(?:accDescr\s*\{\s*)/i,/^(?:[\}])/i,/^(?:[^\}]*)/i,/^(?:classDef\s+)/i,/^(?:DEFAULT\s+)/i,/^(?:\w+\s+)/i,/^(?:[^\n]*)/i,/^(?:class\s+)/i,/^(?:(\w+)+((,\s*\w+)*))/i,/^(?:[^\n]*)/i,/^(?:style\s+)/i,/^(?:[\w,]+\s+)/i,/^(?:[^\n]*)/i,/^(?:scale\s+)/i,/^(?:\d+)/i,/^(?:\s+width\b)/i,/^(?:state\s+)/i,/^(?:.*<<fork>>)/i,/^(?:.*<<join>>)/i,/^(?:.*<<choice>>)/i,/^(?:.*\[\[fork\]\])/i,/^(?:.*\[\[join\]\])/i,/^(?:.*\[\[choice\]\])/i,/^(?:.*direction\s+TB[^\n]*)/i,/^(?:.*direction\s+BT[^\n]*)/i,/^(?:.*direction\s+RL[^\n]*)/i,/^(?:.*direction\s+LR[^\n]*)/i,/^(?:["])/i,/^(?:\s*as\s+)/i,/^(?:[^\n\{]*)/i,/^(?:["])/i,/^(?:[^"]*)/i,/^(?:\w+\s+\w+.*?\{)/i,/^(?:[^\n\s\{]+)/i,/^(?:\n)/i,/^(?:\{)/i,/^(?:\})/i,/^(?:[\n])/i,/^(?:note\s+)/i,/^(?:left of\b)/i,/^(?:right of\b)/i,/^(?:")/i,/^(?:\s*as\s*)/i,/^(?:["])/i,/^(?:[^"]*)/i,/^(?:[^\n]*)/i,/^(?:\s*[^:\n\s\-]+)/i,/^(?:\s*:[^:\n;]+)/i,/^(?:[\s\S]*?\n\s*end note\b)/i,/^(?:stateDiagram\s+)/i,/^(?:stateDiagram-v2\s+)/i,/^(?:hide empty description\b)/i,/^(?:\[\*\])/i,/^(?:[^:\n\s\-\{]+)/i,/^(?:\s*:(?:[^:\n;]|:[^:\n;])+)/i,/^(?:-->)/i,/^(?:--)/i,/^(?::::)/i,/^(?:$)/i,/^(?:.)/i],conditions:{LINE:{rules:[10,11,12],inclusive:!1},struct:{rules:[10,11,12,23,27,30,36,43,44,45,46,56,57,58,72,73,74,75,76,77],inclusive:!1},FLOATING_NOTE_ID:{rules:[65],inclusive:!1},FLOATING_NOTE:{rules:[62,63,64],inclusive:!1},NOTE_TEXT:{rules:[67,68],inclusive:!1},NOTE_ID:{rules:[66],inclusive:!1},NOTE:{rules:[59,60,61],inclusive:!1},STYLEDEF_STYLEOPTS:{rules:[],inclusive:!1},STYLEDEF_STYLES:{rules:[32],inclusive:!1},STYLE_IDS:{rules:[],inclusive:!1},STYLE:{rules:[31],inclusive:!1},CLASS_STYLE:{rules:[29],inclusive:!1},CLASS:{rules:[28],inclusive:!1},CLASSDEFID:{rules:[26],inclusive:!1},CLASSDEF:{rules:[24,25],inclusive:!1},acc_descr_multiline:{rules:[21,22],inclusive:!1},acc_descr:{rules:[19],inclusive:!1},acc_title:{rules:[17],inclusive:!1},SCALE:{rules:[14,15,34,35],inclusive:!1},ALIAS:{rules:[],inclusive:!1},STATE_ID:{rules:[49],inclusive:!1},STATE_STRING:{rules:[50,51],inclusive:!1},FORK_STATE:{rules:[],inclusive:!1},STATE:{rules:[10,11,12,37,38,39,40,41,42,47,48,52,53,54,55],inclusive:!1},ID:{rules:[10,11,12],inclusive:!1},INITIAL:{rules:[0,1,2,3,4,5,6,7,8,9,11,12,13,16,18,20,23,27,30,33,36,55,58,69,70,71,72,73,74,75,77,78,79],inclusive:!0}}};return M})();mt.lexer=ge;function ht(){this.yy={}}return h(ht,"Parser"),ht.prototype=mt,mt.Parser=ht,new ht})();Dt.parser=Dt;var te=Dt,De="TB",ee="TB",Ht="dir",Q="state",q="root",Ct="relation",Ce="classDef",Ae="style",Le="applyClass",st="default",se="divider",re="fill:none",ie="fill: #333",ae="c",ne="markdown",oe="normal",xt="rect",vt="rectWithTitle",we="stateStart",Ie="stateEnd",Kt="divider",Xt="roundedWithTitle",Re="note",Oe="noteGroup",rt="statediagram",Ne="state",$e=`${rt}-${Ne}`,le="transition",Be="note",Pe="note-edge",Fe=`${le} ${Pe}`,Ge=`${rt}-${Be}`,Ye="cluster",Ve=`${rt}-${Ye}`,Me="cluster-alt",We=`${rt}-${Me}`,ce="parent",he="note",je="state",At="----",Ue=`${At}${he}`,Jt=`${At}${ce}`,de=h((t,e=ee)=>{if(!t.doc)return e;let i=e;for(let s of t.doc)s.stmt==="dir"&&(i=s.value);return i},"getDir"),ze=h(function(t,e){return e.db.getClasses()},"getClasses"),He=h(async function(t,e,i,s){T.info("REF0:"),T.info("Drawing state diagram (v2)",e);let{securityLevel:o,state:d,layout:p}=N();s.db.extract(s.db.getRootDocV2());let y=s.db.getData(),n=jt(e,o);y.type=s.type,y.layoutAlgorithm=p,y.nodeSpacing=d?.nodeSpacing||50,y.rankSpacing=d?.rankSpacing||50,N().look==="neo"?y.markers=["barbNeo"]:y.markers=["barb"],y.diagramId=e,await Wt(y,n);let E=8;try{(typeof s.db.getLinks=="function"?s.db.getLinks():new Map).forEach((A,_)=>{let f=typeof _=="string"?_:typeof _?.id=="string"?_.id:"",L=y.nodes.find(w=>w.id===f);if(!f){T.warn("\u26A0\uFE0F Invalid or missing stateId from key:",JSON.stringify(_));return}let $=n.node()?.querySelectorAll("g.node, g.rough-node"),D;if($?.forEach(w=>{let H=w.textContent?.trim();(w.id===L?.domId||H===f)&&(D=w)}),!D){T.warn("\u26A0\uFE0F Could not find node matching text:",f);return}let P=D.parentNode;if(!P){T.warn("\u26A0\uFE0F Node has no parent, cannot wrap:",f);return}let C=document.createElementNS("http://www.w3.org/2000/svg","a"),F=A.url.replace(/^"+|"+$/g,"");if(C.setAttributeNS("http://www.w3.org/1999/xlink","xlink:href",F),C.setAttribute("target","_blank"),A.tooltip){let w=A.tooltip.replace(/^"+|"+$/g,"");C.setAttribute("title",w),D.setAttribute("title",w)}P.replaceChild(C,D),C.appendChild(D),T.info("\u{1F517} Wrapped node in <a> tag for:",f,A.url)})}catch(R){T.error("\u274C Error injecting clickable links:",R)}Mt.insertTitle(n,"statediagramTitleText",d?.titleTopMargin??25,s.db.getDiagramTitle()),Ut(n,E,rt,d?.useMaxWidth??!0)},"draw"),ue={getClasses:ze,draw:He,getDir:de},St=new Map,j=0;function gt(t="",e=0,i="",s=At){let o=i!==null&&i.length>0?`${s}${i}`:"";return`${je}-${t}${o}-${e}`}h(gt,"stateDomId");var Ke=h((t,e,i,s,o,d,p,y)=>{T.trace("items",e),e.forEach(n=>{switch(n.stmt){case Q:et(t,n,i,s,o,d,p,y);break;case st:et(t,n,i,s,o,d,p,y);break;case Ct:{et(t,n.state1,i,s,o,d,p,y),et(t,n.state2,i,s,o,d,p,y);let m=p==="neo",E={id:"edge"+j,start:n.state1.id,end:n.state2.id,arrowhead:"normal",arrowTypeEnd:m?"arrow_barb_neo":"arrow_barb",style:re,labelStyle:"",label:W.sanitizeText(n.description??"",N()),arrowheadStyle:ie,labelpos:ae,labelType:ne,thickness:oe,classes:le,look:p};o.push(E),j++}break}})},"setupDoc"),qt=h((t,e=ee)=>{let i=e;if(t.doc)for(let s of t.doc)s.stmt==="dir"&&(i=s.value);return i},"getDir");function tt(t,e,i){if(!e.id||e.id==="</join></fork>"||e.id==="</choice>")return;e.cssClasses&&(Array.isArray(e.cssCompiledStyles)||(e.cssCompiledStyles=[]),e.cssClasses.split(" ").forEach(o=>{let d=i.get(o);d&&(e.cssCompiledStyles=[...e.cssCompiledStyles??[],...d.styles])}));let s=t.find(o=>o.id===e.id);s?Object.assign(s,e):t.push(e)}h(tt,"insertOrUpdateNode");function fe(t){return t?.classes?.join(" ")??""}h(fe,"getClassesFromDbInfo");function pe(t){return t?.styles??[]}h(pe,"getStylesFromDbInfo");var et=h((t,e,i,s,o,d,p,y)=>{let n=e.id,m=i.get(n),E=fe(m),R=pe(m),A=N();if(T.info("dataFetcher parsedItem",e,m,R),n!=="root"){let _=xt;e.start===!0?_=we:e.start===!1&&(_=Ie),e.type!==st&&(_=e.type),St.get(n)||St.set(n,{id:n,shape:_,description:W.sanitizeText(n,A),cssClasses:`${E} ${$e}`,cssStyles:R});let f=St.get(n);e.description&&(Array.isArray(f.description)?(f.shape=vt,f.description.push(e.description)):f.description?.length&&f.description.length>0?(f.shape=vt,f.description===n?f.description=[e.description]:f.description=[f.description,e.description]):(f.shape=xt,f.description=e.description),f.description=W.sanitizeTextOrArray(f.description,A)),f.description?.length===1&&f.shape===vt&&(f.type==="group"?f.shape=Xt:f.shape=xt),!f.type&&e.doc&&(T.info("Setting cluster for XCX",n,qt(e)),f.type="group",f.isGroup=!0,f.dir=qt(e),f.shape=e.type===se?Kt:Xt,f.cssClasses=`${f.cssClasses} ${Ve} ${d?We:""}`);let L={labelStyle:"",shape:f.shape,label:f.description,cssClasses:f.cssClasses,cssCompiledStyles:[],cssStyles:f.cssStyles,id:n,dir:f.dir,domId:gt(n,j),type:f.type,isGroup:f.type==="group",padding:8,rx:10,ry:10,look:p,labelType:"markdown"};if(L.shape===Kt&&(L.label=""),t&&t.id!=="root"&&(T.trace("Setting node ",n," to be child of its parent ",t.id),L.parentId=t.id),L.centerLabel=!0,e.note){let $={labelStyle:"",shape:Re,label:e.note.text,labelType:"markdown",cssClasses:Ge,cssStyles:[],cssCompiledStyles:[],id:n+Ue+"-"+j,domId:gt(n,j,he),type:f.type,isGroup:f.type==="group",padding:A.flowchart?.padding,look:p,position:e.note.position},D=n+Jt,P={labelStyle:"",shape:Oe,label:e.note.text,cssClasses:f.cssClasses,cssStyles:[],id:n+Jt,domId:gt(n,j,ce),type:"group",isGroup:!0,padding:16,look:p,position:e.note.position};j++,P.id=D,$.parentId=D,tt(s,P,y),tt(s,$,y),tt(s,L,y);let C=n,F=$.id;e.note.position==="left of"&&(C=$.id,F=n),o.push({id:C+"-"+F,start:C,end:F,arrowhead:"none",arrowTypeEnd:"",style:re,labelStyle:"",classes:Fe,arrowheadStyle:ie,labelpos:ae,labelType:ne,thickness:oe,look:p})}else tt(s,L,y)}e.doc&&(T.trace("Adding nodes children "),Ke(e,e.doc,i,s,o,!d,p,y))},"dataFetcher"),Xe=h(()=>{St.clear(),j=0},"reset"),v={START_NODE:"[*]",START_TYPE:"start",END_NODE:"[*]",END_TYPE:"end",COLOR_KEYWORD:"color",FILL_KEYWORD:"fill",BG_FILL:"bgFill",STYLECLASS_SEP:","},Qt=h(()=>new Map,"newClassesList"),Zt=h(()=>({relations:[],states:new Map,documents:{}}),"newDoc"),yt=h(t=>JSON.parse(JSON.stringify(t)),"clone"),ye=class{constructor(t){this.version=t,this.nodes=[],this.edges=[],this.rootDoc=[],this.classes=Qt(),this.documents={root:Zt()},this.currentDocument=this.documents.root,this.startEndCount=0,this.dividerCnt=0,this.links=new Map,this.funs=[],this.getAccTitle=Bt,this.setAccTitle=$t,this.getAccDescription=Ft,this.setAccDescription=Pt,this.setDiagramTitle=Gt,this.getDiagramTitle=Yt,this.clear(),this.setRootDoc=this.setRootDoc.bind(this),this.getDividerId=this.getDividerId.bind(this),this.setDirection=this.setDirection.bind(this),this.trimColon=this.trimColon.bind(this),this.bindFunctions=this.bindFunctions.bind(this)}static{h(this,"StateDB")}static{this.relationType={AGGREGATION:0,EXTENSION:1,COMPOSITION:2,DEPENDENCY:3}}extract(t){this.clear(!0);for(let s of Array.isArray(t)?t:t.doc)switch(s.stmt){case Q:this.addState(s.id.trim(),s.type,s.doc,s.description,s.note);break;case Ct:this.addRelation(s.state1,s.state2,s.description);break;case Ce:this.addStyleClass(s.id.trim(),s.classes);break;case Ae:this.handleStyleDef(s);break;case Le:this.setCssClass(s.id.trim(),s.styleClass);break;case"click":this.addLink(s.id,s.url,s.tooltip);break}let e=this.getStates(),i=N();Xe(),et(void 0,this.getRootDocV2(),e,this.nodes,this.edges,!0,i.look,this.classes);for(let s of this.nodes)if(Array.isArray(s.label)){if(s.description=s.label.slice(1),s.isGroup&&s.description.length>0)throw new Error(`Group nodes can only have label. Remove the additional description for node [${s.id}]`);s.label=s.label[0]}}handleStyleDef(t){let e=t.id.trim().split(","),i=t.styleClass.split(",");for(let s of e){let o=this.getState(s);if(!o){let d=s.trim();this.addState(d),o=this.getState(d)}o&&(o.styles=i.map(d=>d.replace(/;/g,"")?.trim()))}}setRootDoc(t){T.info("Setting root doc",t),this.rootDoc=t,this.version===1?this.extract(t):this.extract(this.getRootDocV2())}docTranslator(t,e,i){if(e.stmt===Ct){this.docTranslator(t,e.state1,!0),this.docTranslator(t,e.state2,!1);return}if(e.stmt===Q&&(e.id===v.START_NODE?(e.id=t.id+(i?"_start":"_end"),e.start=i):e.id=e.id.trim()),e.stmt!==q&&e.stmt!==Q||!e.doc)return;let s=[],o=[];for(let d of e.doc)if(d.type===se){let p=yt(d);p.doc=yt(o),s.push(p),o=[]}else o.push(d);if(s.length>0&&o.length>0){let d={stmt:Q,id:Vt(),type:"divider",doc:yt(o)};s.push(yt(d)),e.doc=s}e.doc.forEach(d=>this.docTranslator(e,d,!0))}getRootDocV2(){return this.docTranslator({id:q,stmt:q},{id:q,stmt:q,doc:this.rootDoc},!0),{id:q,doc:this.rootDoc}}addState(t,e=st,i=void 0,s=void 0,o=void 0,d=void 0,p=void 0,y=void 0){let n=t?.trim();if(!this.currentDocument.states.has(n))T.info("Adding state ",n,s),this.currentDocument.states.set(n,{stmt:Q,id:n,descriptions:[],type:e,doc:i,note:o,classes:[],styles:[],textStyles:[]});else{let m=this.currentDocument.states.get(n);if(!m)throw new Error(`State not found: ${n}`);m.doc||(m.doc=i),m.type||(m.type=e)}if(s&&(T.info("Setting state description",n,s),(Array.isArray(s)?s:[s]).forEach(E=>this.addDescription(n,E.trim()))),o){let m=this.currentDocument.states.get(n);if(!m)throw new Error(`State not found: ${n}`);m.note=o,m.note.text=W.sanitizeText(m.note.text,N())}d&&(T.info("Setting state classes",n,d),(Array.isArray(d)?d:[d]).forEach(E=>this.setCssClass(n,E.trim()))),p&&(T.info("Setting state styles",n,p),(Array.isArray(p)?p:[p]).forEach(E=>this.setStyle(n,E.trim()))),y&&(T.info("Setting state styles",n,p),(Array.isArray(y)?y:[y]).forEach(E=>this.setTextStyle(n,E.trim())))}clear(t){this.nodes=[],this.edges=[],this.funs=[this.setupToolTips.bind(this)],this.documents={root:Zt()},this.currentDocument=this.documents.root,this.startEndCount=0,this.classes=Qt(),t||(this.links=new Map,Nt())}getState(t){return this.currentDocument.states.get(t)}getStates(){return this.currentDocument.states}logDocuments(){T.info("Documents = ",this.documents)}getRelations(){return this.currentDocument.relations}addLink(t,e,i){this.links.set(t,{url:e,tooltip:i}),T.warn("Adding link",t,e,i)}getLinks(){return this.links}startIdIfNeeded(t=""){return t===v.START_NODE?(this.startEndCount++,`${v.START_TYPE}${this.startEndCount}`):t}startTypeIfNeeded(t="",e=st){return t===v.START_NODE?v.START_TYPE:e}endIdIfNeeded(t=""){return t===v.END_NODE?(this.startEndCount++,`${v.END_TYPE}${this.startEndCount}`):t}endTypeIfNeeded(t="",e=st){return t===v.END_NODE?v.END_TYPE:e}addRelationObjs(t,e,i=""){let s=this.startIdIfNeeded(t.id.trim()),o=this.startTypeIfNeeded(t.id.trim(),t.type),d=this.startIdIfNeeded(e.id.trim()),p=this.startTypeIfNeeded(e.id.trim(),e.type);this.addState(s,o,t.doc,t.description,t.note,t.classes,t.styles,t.textStyles),this.addState(d,p,e.doc,e.description,e.note,e.classes,e.styles,e.textStyles),this.currentDocument.relations.push({id1:s,id2:d,relationTitle:W.sanitizeText(i,N())})}addRelation(t,e,i){if(typeof t=="object"&&typeof e=="object")this.addRelationObjs(t,e,i);else if(typeof t=="string"&&typeof e=="string"){let s=this.startIdIfNeeded(t.trim()),o=this.startTypeIfNeeded(t),d=this.endIdIfNeeded(e.trim()),p=this.endTypeIfNeeded(e);this.addState(s,o),this.addState(d,p),this.currentDocument.relations.push({id1:s,id2:d,relationTitle:i?W.sanitizeText(i,N()):void 0})}}addDescription(t,e){let i=this.currentDocument.states.get(t),s=e.startsWith(":")?e.replace(":","").trim():e;i?.descriptions?.push(W.sanitizeText(s,N()))}cleanupLabel(t){return t.startsWith(":")?t.slice(2).trim():t.trim()}getDividerId(){return this.dividerCnt++,`divider-id-${this.dividerCnt}`}addStyleClass(t,e=""){this.classes.has(t)||this.classes.set(t,{id:t,styles:[],textStyles:[]});let i=this.classes.get(t);e&&i&&e.split(v.STYLECLASS_SEP).forEach(s=>{let o=s.replace(/([^;]*);/,"$1").trim();if(RegExp(v.COLOR_KEYWORD).exec(s)){let p=o.replace(v.FILL_KEYWORD,v.BG_FILL).replace(v.COLOR_KEYWORD,v.FILL_KEYWORD);i.textStyles.push(p)}i.styles.push(o)})}getClasses(){return this.classes}setupToolTips(t){let e=zt();B(t).select("svg").selectAll("g.node, g.rough-node").on("mouseover",o=>{let d=B(o.currentTarget),p=d.attr("title");if(p===null)return;let y=o.currentTarget?.getBoundingClientRect();e.transition().duration(200).style("opacity",".9"),e.style("left",window.scrollX+y.left+(y.right-y.left)/2+"px").style("top",window.scrollY+y.bottom+"px"),e.html(Rt.sanitize(p)),d.classed("hover",!0)}).on("mouseout",o=>{e.transition().duration(500).style("opacity",0),B(o.currentTarget).classed("hover",!1)})}setCssClass(t,e){t.split(",").forEach(i=>{let s=this.getState(i);if(!s){let o=i.trim();this.addState(o),s=this.getState(o)}s?.classes?.push(e)})}setStyle(t,e){this.getState(t)?.styles?.push(e)}setTextStyle(t,e){this.getState(t)?.textStyles?.push(e)}bindFunctions(t){this.funs.forEach(e=>{e(t)})}getDirectionStatement(){return this.rootDoc.find(t=>t.stmt===Ht)}getDirection(){return this.getDirectionStatement()?.value??De}setDirection(t){let e=this.getDirectionStatement();e?e.value=t:this.rootDoc.unshift({stmt:Ht,value:t})}trimColon(t){return t.startsWith(":")?t.slice(1).trim():t.trim()}getData(){let t=N();return{nodes:this.nodes,edges:this.edges,other:{},config:t,direction:de(this.getRootDocV2())}}getConfig(){return N().state}},Je=h(t=>`
defs [id$="-barbEnd"] {
    fill: ${t.transitionColor};
    stroke: ${t.transitionColor};
  }
g.stateGroup text {
  fill: ${t.nodeBorder};
  stroke: none;
  font-size: 10px;
}
g.stateGroup text {
  fill: ${t.textColor};
  stroke: none;
  font-size: 10px;

}
g.stateGroup .state-title {
  font-weight: bolder;
  fill: ${t.stateLabelColor};
}

g.stateGroup rect {
  fill: ${t.mainBkg};
  stroke: ${t.nodeBorder};
}

g.stateGroup line {
  stroke: ${t.lineColor};
  stroke-width: ${t.strokeWidth||1};
}

.transition {
  stroke: ${t.transitionColor};
  stroke-width: ${t.strokeWidth||1};
  fill: none;
}

.stateGroup .composit {
  fill: ${t.background};
  border-bottom: 1px
}

.stateGroup .alt-composit {
  fill: #e0e0e0;
  border-bottom: 1px
}

.state-note {
  stroke: ${t.noteBorderColor};
  fill: ${t.noteBkgColor};

  text {
    fill: ${t.noteTextColor};
    stroke: none;
    font-size: 10px;
  }
}

.stateLabel .box {
  stroke: none;
  stroke-width: 0;
  fill: ${t.mainBkg};
  opacity: 0.5;
}

.edgeLabel .label rect {
  fill: ${t.labelBackgroundColor};
  opacity: 0.5;
}
.edgeLabel {
  background-color: ${t.edgeLabelBackground};
  p {
    background-color: ${t.edgeLabelBackground};
  }
  rect {
    opacity: 0.5;
    background-color: ${t.edgeLabelBackground};
    fill: ${t.edgeLabelBackground};
  }
  text-align: center;
}
.edgeLabel .label text {
  fill: ${t.transitionLabelColor||t.tertiaryTextColor};
}
.label div .edgeLabel {
  color: ${t.transitionLabelColor||t.tertiaryTextColor};
}

.stateLabel text {
  fill: ${t.stateLabelColor};
  font-size: 10px;
  font-weight: bold;
}

.node circle.state-start {
  fill: ${t.specialStateColor};
  stroke: ${t.specialStateColor};
}

.node .fork-join {
  fill: ${t.specialStateColor};
  stroke: ${t.specialStateColor};
}

.node circle.state-end {
  fill: ${t.innerEndBackground};
  stroke: ${t.background};
  stroke-width: 1.5
}
.end-state-inner {
  fill: ${t.compositeBackground||t.background};
  // stroke: ${t.background};
  stroke-width: 1.5
}

.node rect {
  fill: ${t.stateBkg||t.mainBkg};
  stroke: ${t.stateBorder||t.nodeBorder};
  stroke-width: ${t.strokeWidth||1}px;
}
.node polygon {
  fill: ${t.mainBkg};
  stroke: ${t.stateBorder||t.nodeBorder};;
  stroke-width: ${t.strokeWidth||1}px;
}
[id$="-barbEnd"] {
  fill: ${t.lineColor};
}

.statediagram-cluster rect {
  fill: ${t.compositeTitleBackground};
  stroke: ${t.stateBorder||t.nodeBorder};
  stroke-width: ${t.strokeWidth||1}px;
}

.cluster-label, .nodeLabel {
  color: ${t.stateLabelColor};
  // line-height: 1;
}

.statediagram-cluster rect.outer {
  rx: 5px;
  ry: 5px;
}
.statediagram-state .divider {
  stroke: ${t.stateBorder||t.nodeBorder};
}

.statediagram-state .title-state {
  rx: 5px;
  ry: 5px;
}
.statediagram-cluster.statediagram-cluster .inner {
  fill: ${t.compositeBackground||t.background};
}
.statediagram-cluster.statediagram-cluster-alt .inner {
  fill: ${t.altBackground?t.altBackground:"#efefef"};
}

.statediagram-cluster .inner {
  rx:0;
  ry:0;
}

.statediagram-state rect.basic {
  rx: 5px;
  ry: 5px;
}
.statediagram-state rect.divider {
  stroke-dasharray: 10,10;
  fill: ${t.altBackground?t.altBackground:"#efefef"};
}

.note-edge {
  stroke-dasharray: 5;
}

.statediagram-note rect {
  fill: ${t.noteBkgColor};
  stroke: ${t.noteBorderColor};
  stroke-width: 1px;
  rx: 0;
  ry: 0;
}
.statediagram-note rect {
  fill: ${t.noteBkgColor};
  stroke: ${t.noteBorderColor};
  stroke-width: 1px;
  rx: 0;
  ry: 0;
}

.statediagram-note text {
  fill: ${t.noteTextColor};
}

.statediagram-note .nodeLabel {
  color: ${t.noteTextColor};
}
.statediagram .edgeLabel {
  color: red; // ${t.noteTextColor};
}

[id$="-dependencyStart"], [id$="-dependencyEnd"] {
  fill: ${t.lineColor};
  stroke: ${t.lineColor};
  stroke-width: ${t.strokeWidth||1};
}

.statediagramTitleText {
  text-anchor: middle;
  font-size: 18px;
  fill: ${t.textColor};
}

[data-look="neo"].statediagram-cluster rect {
  fill: ${t.mainBkg};
  stroke: ${t.useGradient?"url("+t.svgId+"-gradient)":t.stateBorder||t.nodeBorder};
  stroke-width: ${t.strokeWidth??1};
}
[data-look="neo"].statediagram-cluster rect.outer {
  rx: ${t.radius}px;
  ry: ${t.radius}px;
  filter: ${t.dropShadow?t.dropShadow.replace("url(#drop-shadow)",`url(${t.svgId}-drop-shadow)`):"none"}
}
`,"getStyles"),Se=Je;var Fs={parser:te,get db(){return new ye(2)},renderer:ue,styles:Se,init:h(t=>{t.state||(t.state={}),t.state.arrowMarkerAbsolute=t.arrowMarkerAbsolute},"init")};export{Fs as diagram};
